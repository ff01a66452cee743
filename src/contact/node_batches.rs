//! Contacts of nodes with one rounded or mesh tool, in batches of sixteen nodes.
//!
//! The contact equals that of `node_contacts.rs`, in closed form. Nodes that need a sweep are deferred to that module.
//! These are nodes that touch a rounded tool only later in the slice, and nodes that move far relative to a mesh or
//! have done so since its last query.

use glam::{DVec3, Mat3, Quat, Vec3};

use super::nearest_plane::NearestPlane;
use super::path::MeshPose;
use super::sweep_control::depth_correction;
use super::time_of_impact::{Segment, TOUCHING};
use crate::geometry::Aabb;
use crate::nodes::NodeDamping;
use crate::simd::Loops;

/// Nodes per batch.
const LANES: usize = 16;

type F32Lanes = [f32; LANES];

/// Input and output of the batches: the nodes and the tool.
pub(super) struct NodeBatches<'a> {
    /// The candidate nodes.
    pub nodes: &'a [u32],
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a mut [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    pub inverse_masses: &'a [f32],
    pub damping: Option<&'a NodeDamping>,
    /// s
    pub substep: f32,
    pub solid: BatchSolid<'a>,
    /// Contact thickness, m.
    pub thickness: f32,
    /// Bound on the approach of any node and the tool in the slice, m.
    pub closing: f32,
    /// The tool's position at the end.
    pub center: Vec3,
    pub friction: f32,
    /// Receives nodes that may touch within the slice. Memory for all nodes is reserved.
    pub deferred: &'a mut Vec<u32>,
}

/// The shape of a tool over a slice.
#[derive(Clone, Copy)]
pub(super) enum BatchSolid<'a> {
    /// The segment of the tool and its angular velocity, rad/s.
    Round { segment: Segment, spin: Vec3 },
    /// The plane of the mesh for each node. Nodes that have moved further than `flat`, m, since the query or move that
    /// far in this slice are deferred.
    Mesh {
        planes: &'a [NearestPlane],
        slot: u32,
        from: MeshPose,
        to: MeshPose,
        flat: f32,
    },
}

/// The contacts of a batch.
struct LaneContacts {
    /// m; negative inside.
    gap: F32Lanes,
    /// Unit normal, away from the tool.
    normal: [F32Lanes; 3],
    /// Velocity of the tool's surface, m/s.
    surface_velocity: [F32Lanes; 3],
    /// Vector from the tool's position, m.
    arm: [F32Lanes; 3],
    /// True for nodes that may receive an impulse.
    touches: [bool; LANES],
}

/// Total impulse on the tool, and the bounding box of the resulting velocities.
pub(super) struct BatchSums {
    /// N s
    pub impulse: DVec3,
    /// N m s, about the tool's position.
    pub angular_impulse: DVec3,
    pub velocities: Aabb,
}

/// Impulses and velocity bounds per lane.
struct LaneSums {
    impulse: [[f64; LANES]; 3],
    angular_impulse: [[f64; LANES]; 3],
    low: [F32Lanes; 3],
    high: [F32Lanes; 3],
}

impl LaneSums {
    const NONE: Self = Self {
        impulse: [[0.0; LANES]; 3],
        angular_impulse: [[0.0; LANES]; 3],
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::NEG_INFINITY; LANES]; 3],
    };

    fn sum(&self) -> BatchSums {
        let sums = |lanes: &[[f64; LANES]; 3]| DVec3::from_array(lanes.map(|lanes| -lanes.iter().sum::<f64>()));
        let lowest = |lanes: F32Lanes| lanes.into_iter().fold(f32::INFINITY, f32::min);
        let highest = |lanes: F32Lanes| lanes.into_iter().fold(f32::NEG_INFINITY, f32::max);
        BatchSums {
            impulse: sums(&self.impulse),
            angular_impulse: sums(&self.angular_impulse),
            velocities: Aabb {
                min: self.low.map(lowest).into(),
                max: self.high.map(highest).into(),
            },
        }
    }
}

/// Computes a value for each lane.
#[inline(always)]
fn per_lane(value: impl Fn(usize) -> f32) -> F32Lanes {
    let mut lanes = [0.0; LANES];
    for (lane, to) in lanes.iter_mut().enumerate() {
        *to = value(lane);
    }
    lanes
}

#[inline(always)]
fn dot(a: &[F32Lanes; 3], b: &[F32Lanes; 3]) -> F32Lanes {
    per_lane(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

#[inline(always)]
fn vectors(component: impl Fn(usize, usize) -> f32) -> [F32Lanes; 3] {
    [
        per_lane(|lane| component(0, lane)),
        per_lane(|lane| component(1, lane)),
        per_lane(|lane| component(2, lane)),
    ]
}

/// Gathers the vectors of these nodes. Consecutive nodes are contiguous in memory.
#[inline(always)]
fn gather(from: [&[f32]; 3], nodes: &[usize; LANES]) -> [F32Lanes; 3] {
    if is_contiguous(nodes) {
        let first = nodes[0];
        let [x, y, z] = from.map(|axis| &axis[first..first + LANES]);
        return [
            per_lane(|lane| x[lane]),
            per_lane(|lane| y[lane]),
            per_lane(|lane| z[lane]),
        ];
    }
    vectors(|axis, lane| from[axis][nodes[lane]])
}

#[inline(always)]
fn is_contiguous(nodes: &[usize; LANES]) -> bool {
    nodes[LANES - 1] == nodes[0] + LANES - 1
}

impl Loops for NodeBatches<'_> {
    type Output = BatchSums;

    #[inline(always)]
    fn run(mut self) -> BatchSums {
        let mut sums = LaneSums::NONE;
        for (index, chunk) in self.nodes.chunks(LANES).enumerate() {
            self.solve_chunk(index * LANES, chunk, &mut sums);
        }
        sums.sum()
    }
}

impl NodeBatches<'_> {
    #[inline(always)]
    fn solve_chunk(&mut self, first: usize, chunk: &[u32], sums: &mut LaneSums) {
        let substep = self.substep;
        let depth_factor = depth_correction(substep);
        let mut nodes = [chunk[0] as usize; LANES];
        for (node, &chunk_node) in nodes.iter_mut().zip(chunk) {
            *node = chunk_node as usize;
        }
        let positions = gather(self.positions, &nodes);
        let contacts = match self.solid {
            BatchSolid::Round { segment, spin } => self.rounded_contacts((chunk, &nodes), &positions, &segment, spin),
            BatchSolid::Mesh {
                planes,
                slot,
                from,
                to,
                flat,
            } => self.mesh_contacts(
                (chunk, &nodes),
                &positions,
                (&planes[first..], slot),
                [&from, &to],
                flat,
            ),
        };
        let Some(LaneContacts {
            gap,
            normal,
            surface_velocity,
            arm,
            touches,
        }) = contacts
        else {
            return;
        };
        let velocities = gather(self.velocities.each_ref().map(|axis| &**axis), &nodes);
        let inv_masses = self.inv_masses(&nodes);
        let speed = dot(&velocities, &normal);
        let surface_speed = dot(&surface_velocity, &normal);
        let per_substep = 1.0 / substep;
        let impulse = per_lane(|lane| {
            let target = surface_speed[lane] - gap[lane].max(0.0) * per_substep;
            ((target - speed[lane]) / inv_masses[lane]).max(0.0)
        });
        let slip = vectors(|k, lane| {
            let across = speed[lane] - surface_speed[lane];
            velocities[k][lane] - surface_velocity[k][lane] - normal[k][lane] * across
        });
        let slip_squared = dot(&slip, &slip);
        let friction = per_lane(|lane| {
            let friction_limit = self.friction * impulse[lane] * inv_masses[lane];
            let slip = slip_squared[lane].sqrt();
            if slip > friction_limit {
                friction_limit / slip
            } else {
                1.0
            }
        });
        let is_pressed = |lane: usize| touches[lane] && impulse[lane] > 0.0;
        let has_friction = self.friction > 0.0;
        let change = vectors(|k, lane| {
            let across = if has_friction {
                slip[k][lane] * friction[lane]
            } else {
                0.0
            };
            normal[k][lane] * (impulse[lane] * inv_masses[lane]) - across
        });
        let applied = vectors(|k, lane| {
            if is_pressed(lane) {
                change[k][lane] / inv_masses[lane]
            } else {
                0.0
            }
        });
        let moment = vectors(|k, lane| {
            let [i, j] = [(k + 1) % 3, (k + 2) % 3];
            if is_pressed(lane) {
                arm[i][lane] * applied[j][lane] - arm[j][lane] * applied[i][lane]
            } else {
                0.0
            }
        });
        for k in 0..3 {
            for lane in 0..LANES {
                sums.impulse[k][lane] += f64::from(applied[k][lane]);
                sums.angular_impulse[k][lane] += f64::from(moment[k][lane]);
            }
        }

        let depth = per_lane(|lane| if touches[lane] { (-gap[lane]).max(0.0) } else { 0.0 });
        if is_contiguous(&nodes) {
            let first = nodes[0];
            for k in 0..3 {
                let new_velocity = &mut self.velocities[k][first..first + LANES];
                let next = &mut self.next_positions[k][first..first + LANES];
                let (low, high) = (&mut sums.low[k], &mut sums.high[k]);
                for lane in 0..LANES {
                    let velocity = velocities[k][lane] + change[k][lane];
                    let moved = positions[k][lane] + velocity * substep;
                    let is_updated = is_pressed(lane);
                    new_velocity[lane] = if is_updated { velocity } else { new_velocity[lane] };
                    let moved = if is_updated { moved } else { next[lane] };
                    let out = normal[k][lane] * (depth_factor * depth[lane]);
                    next[lane] = if depth[lane] > 0.0 { moved + out } else { moved };
                    low[lane] = if is_updated { velocity.min(low[lane]) } else { low[lane] };
                    high[lane] = if is_updated {
                        velocity.max(high[lane])
                    } else {
                        high[lane]
                    };
                }
            }
            return;
        }
        for lane in 0..chunk.len() {
            let is_updated = is_pressed(lane);
            if !touches[lane] || !is_updated && gap[lane] >= 0.0 {
                continue;
            }
            let node = nodes[lane];
            for k in 0..3 {
                if is_updated {
                    let velocity = velocities[k][lane] + change[k][lane];
                    self.velocities[k][node] = velocity;
                    self.next_positions[k][node] = positions[k][lane] + velocity * substep;
                    sums.low[k][lane] = velocity.min(sums.low[k][lane]);
                    sums.high[k][lane] = velocity.max(sums.high[k][lane]);
                }
                if depth[lane] > 0.0 {
                    self.next_positions[k][node] += normal[k][lane] * (depth_factor * depth[lane]);
                }
            }
        }
    }

    /// Velocity change of each node per impulse, 1/kg.
    #[inline(always)]
    fn inv_masses(&self, nodes: &[usize; LANES]) -> F32Lanes {
        let inverse_masses = per_lane(|lane| self.inverse_masses[nodes[lane]]);
        match self.damping {
            None => inverse_masses,
            Some(NodeDamping { gain, loss, .. }) => {
                per_lane(|lane| inverse_masses[lane] * (gain[nodes[lane]] * (2.0 - loss[nodes[lane]]) / self.substep))
            }
        }
    }

    #[inline(always)]
    fn rounded_contacts(
        &mut self,
        (chunk, nodes): (&[u32], &[usize; LANES]),
        positions: &[F32Lanes; 3],
        segment: &Segment,
        spin: Vec3,
    ) -> Option<LaneContacts> {
        let (radius, contact_radius) = (segment.radius, segment.radius + self.thickness);
        let [a, b] = segment.ends.map(|end| end.to_array());
        let [first, last] = segment.steps.map(|step| step.to_array());
        let axis = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
        // There is no branch on a zero length. Compilers then hoist the terms that all nodes share out of the loop.
        let per_square = 1.0 / square.max(f32::MIN_POSITIVE);
        let from_a = vectors(|k, lane| positions[k][lane] - a[k]);
        let along = per_lane(|lane| {
            let offset_along = from_a[0][lane] * axis[0] + from_a[1][lane] * axis[1] + from_a[2][lane] * axis[2];
            (offset_along * per_square).clamp(0.0, 1.0)
        });
        let offset = vectors(|k, lane| from_a[k][lane] - axis[k] * along[lane]);
        let squares = dot(&offset, &offset);
        let touching = contact_radius * (1.0 + TOUCHING);
        let reach = touching + self.closing;
        let nearest = squares.iter().copied().fold(f32::INFINITY, f32::min);
        if !(nearest <= reach * reach) {
            return None;
        }
        let distance = per_lane(|lane| squares[lane].sqrt());
        let normal = vectors(|k, lane| offset[k][lane] / distance[lane]);
        let step = vectors(|k, lane| first[k] + (last[k] - first[k]) * along[lane]);
        // No point of the tool beyond the plane across the normal is nearer than its furthest end moves.
        let ahead = per_lane(|lane| {
            let projection =
                |step: [f32; 3]| step[0] * normal[0][lane] + step[1] * normal[1][lane] + step[2] * normal[2][lane];
            projection(first).max(projection(last))
        });
        let velocities = gather(self.velocities.each_ref().map(|axis| &**axis), nodes);
        let speed = dot(&velocities, &normal);
        let inverse_masses = per_lane(|lane| self.inverse_masses[nodes[lane]]);
        let (mut touches, mut may_touch) = ([false; LANES], [false; LANES]);
        for lane in 0..LANES {
            let is_free = inverse_masses[lane] > 0.0 && lane < chunk.len();
            let min_distance = distance[lane] + (speed[lane] * self.substep - ahead[lane]).min(0.0);
            touches[lane] = is_free && distance[lane] <= touching && distance[lane] > 0.0;
            may_touch[lane] = is_free && !touches[lane] && min_distance <= touching;
        }
        if may_touch.contains(&true) {
            let deferred = chunk.iter().zip(may_touch).filter(|&(_, may_touch)| may_touch);
            self.deferred.extend(deferred.map(|(&node, _)| node));
        }
        let (spin, center) = (spin.to_array(), self.center.to_array());
        let surface = vectors(|k, lane| normal[k][lane] * radius);
        let per_substep = 1.0 / self.substep;
        Some(LaneContacts {
            gap: per_lane(|lane| distance[lane] - contact_radius),
            normal,
            surface_velocity: vectors(|k, lane| {
                let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                step[k][lane] * per_substep + (spin[i] * surface[j][lane] - spin[j] * surface[i][lane])
            }),
            arm: vectors(|k, lane| a[k] + axis[k] * along[lane] + step[k][lane] + surface[k][lane] - center[k]),
            touches,
        })
    }

    #[inline(always)]
    fn mesh_contacts(
        &mut self,
        (chunk, nodes): (&[u32], &[usize; LANES]),
        positions: &[F32Lanes; 3],
        (planes, slot): (&[NearestPlane], u32),
        [from, to]: [&MeshPose; 2],
        flat: f32,
    ) -> Option<LaneContacts> {
        let near = self.thickness + self.closing;
        let last = chunk.len() - 1;
        let plane = |lane: usize| &planes[lane.min(last)];
        let to_local = rotation_columns(from.orientation.conjugate());
        let to_world = rotation_columns(from.orientation);
        let center = from.center.to_array();
        let from_center = vectors(|k, lane| positions[k][lane] - center[k]);
        let local = rotated(&to_local, &from_center);
        let local_normal = vectors(|k, lane| plane(lane).normal[k]);
        let moved = vectors(|k, lane| local[k][lane] - plane(lane).point[k]);
        let along = dot(&local_normal, &moved);
        let distance = per_lane(|lane| plane(lane).distance + along[lane]);
        let moved_squared = dot(&moved, &moved);
        let mut touches = [false; LANES];
        for (lane, &node) in chunk.iter().enumerate() {
            let is_free = self.inverse_masses[node as usize] > 0.0;
            let is_current = plane(lane).slot == slot;
            let is_flat = is_current && plane(lane).normal != Vec3::ZERO && moved_squared[lane] <= flat * flat;
            let is_far = is_current && !is_flat && plane(lane).distance - moved_squared[lane].sqrt() > near;
            touches[lane] = is_free && is_flat && distance[lane] <= near;
            if is_free && !is_flat && !is_far {
                self.deferred.push(node);
            }
        }
        if !touches.iter().any(|&touches| touches) {
            return None;
        }
        let normal = rotated(&to_world, &local_normal);
        let velocities = gather(self.velocities.each_ref().map(|axis| &**axis), nodes);
        // The solid's surface point moves with the solid.
        let relative_rotation = rotation_columns(to.orientation * from.orientation.conjugate());
        let surface = vectors(|k, lane| from_center[k][lane] - normal[k][lane] * distance[lane]);
        let rotated_surface = rotated(&relative_rotation, &surface);
        let shift = (to.center - from.center).to_array();
        let is_still = from.orientation == to.orientation;
        let step = vectors(|k, lane| {
            let rotation = if is_still {
                0.0
            } else {
                rotated_surface[k][lane] - surface[k][lane]
            };
            shift[k] + rotation
        });
        let travel = vectors(|k, lane| velocities[k][lane] * self.substep - step[k][lane]);
        let travel_squared = dot(&travel, &travel);
        for (lane, &node) in chunk.iter().enumerate() {
            if touches[lane] && travel_squared[lane] > flat * flat {
                touches[lane] = false;
                self.deferred.push(node);
            }
        }
        let per_substep = 1.0 / self.substep;
        let position = self.center.to_array();
        Some(LaneContacts {
            gap: per_lane(|lane| distance[lane] - self.thickness),
            normal,
            surface_velocity: vectors(|k, lane| step[k][lane] * per_substep),
            arm: vectors(|k, lane| center[k] + surface[k][lane] + step[k][lane] - position[k]),
            touches,
        })
    }
}

/// The columns of a rotation matrix.
fn rotation_columns(rotation: Quat) -> [[f32; 3]; 3] {
    Mat3::from_quat(rotation).to_cols_array_2d()
}

#[inline(always)]
fn rotated(columns: &[[f32; 3]; 3], vector: &[F32Lanes; 3]) -> [F32Lanes; 3] {
    let [x, y, z] = columns;
    vectors(|k, lane| x[k] * vector[0][lane] + y[k] * vector[1][lane] + z[k] * vector[2][lane])
}
