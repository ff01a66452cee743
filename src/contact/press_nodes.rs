//! Contacts of nodes with one tool, round or a mesh, sixteen nodes at a time.
//!
//! The same contact as that of `node_contacts.rs`, in closed form. Nodes whose motion has to be swept are left to that: those that do not touch a
//! round tool as the slice begins, but may within it, and those that go far against a mesh, or have gone far since they last looked at it.

use glam::{DVec3, Mat3, Quat, Vec3};

use super::impulses::pushed_out;
use super::nearest_plane::NearestPlane;
use super::path::Placement;
use super::sweep::{Segment, TOUCHING};
use crate::geometry::Bounds;
use crate::nodes::NodeDamping;
use crate::simd::Loops;

/// Nodes side by side.
const LANES: usize = 16;

type Sixteen = [f32; LANES];

/// The nodes and the tool.
pub(super) struct PressNodes<'a> {
    /// Those that may be near.
    pub nodes: &'a [u32],
    pub positions: [&'a [f32]; 3],
    pub velocities: [&'a mut [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    pub inverse_masses: &'a [f32],
    pub damping: Option<&'a NodeDamping>,
    /// s
    pub substep: f32,
    pub solid: PressingSolid<'a>,
    /// What is kept off the tool, m.
    pub thickness: f32,
    /// How much nearer any node and the tool may come in the slice, m.
    pub closing: f32,
    /// The tool's position at the end.
    pub centre: Vec3,
    pub friction: f32,
    /// Receives nodes that may touch within the slice; there is room for all.
    pub undecided: &'a mut Vec<u32>,
}

/// A tool over a slice.
#[derive(Clone, Copy)]
pub(super) enum PressingSolid<'a> {
    /// The segment within it, and how fast it turns, rad/s.
    Round { segment: Segment, spin: Vec3 },
    /// As its planes show it to each of the nodes; nodes that have moved further than `flat`, m, since, or do so now, are left.
    Mesh {
        planes: &'a [NearestPlane],
        slot: u32,
        from: Placement,
        to: Placement,
        flat: f32,
    },
}

/// How sixteen nodes meet the tool.
struct MetLanes {
    /// m; below 0 inside.
    gap: Sixteen,
    /// Away from the tool, of unit length.
    normal: [Sixteen; 3],
    /// Of the tool, m/s.
    surface_velocity: [Sixteen; 3],
    /// From the tool's position, m.
    arm: [Sixteen; 3],
    /// Which of them may be pressed.
    touches: [bool; LANES],
}

/// What all of them gave to the tool, and the box of the velocities that it gave.
pub(super) struct PressedNodes {
    /// N s
    pub impulse: DVec3,
    /// N m s, about the tool's position.
    pub angular_impulse: DVec3,
    pub velocities: Bounds,
}

/// The same of each lane.
struct PressedLanes {
    impulse: [[f64; LANES]; 3],
    angular_impulse: [[f64; LANES]; 3],
    low: [Sixteen; 3],
    high: [Sixteen; 3],
}

impl PressedLanes {
    const NONE: Self = Self {
        impulse: [[0.0; LANES]; 3],
        angular_impulse: [[0.0; LANES]; 3],
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::NEG_INFINITY; LANES]; 3],
    };

    fn sum(&self) -> PressedNodes {
        let sums = |lanes: &[[f64; LANES]; 3]| DVec3::from_array(lanes.map(|lanes| -lanes.iter().sum::<f64>()));
        let least = |lanes: Sixteen| lanes.into_iter().fold(f32::INFINITY, f32::min);
        let most = |lanes: Sixteen| lanes.into_iter().fold(f32::NEG_INFINITY, f32::max);
        PressedNodes {
            impulse: sums(&self.impulse),
            angular_impulse: sums(&self.angular_impulse),
            velocities: Bounds {
                min: self.low.map(least).into(),
                max: self.high.map(most).into(),
            },
        }
    }
}

/// A value for each lane.
#[inline(always)]
fn each(value: impl Fn(usize) -> f32) -> Sixteen {
    let mut lanes = [0.0; LANES];
    for (lane, to) in lanes.iter_mut().enumerate() {
        *to = value(lane);
    }
    lanes
}

#[inline(always)]
fn dot(a: &[Sixteen; 3], b: &[Sixteen; 3]) -> Sixteen {
    each(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

#[inline(always)]
fn vectors(of: impl Fn(usize, usize) -> f32) -> [Sixteen; 3] {
    [
        each(|lane| of(0, lane)),
        each(|lane| of(1, lane)),
        each(|lane| of(2, lane)),
    ]
}

/// The vectors of these nodes; those of a run lie side by side.
#[inline(always)]
fn gathered(from: [&[f32]; 3], nodes: &[usize; LANES]) -> [Sixteen; 3] {
    if is_run(nodes) {
        let first = nodes[0];
        let [x, y, z] = from.map(|axis| &axis[first..first + LANES]);
        return [each(|lane| x[lane]), each(|lane| y[lane]), each(|lane| z[lane])];
    }
    vectors(|axis, lane| from[axis][nodes[lane]])
}

#[inline(always)]
fn is_run(nodes: &[usize; LANES]) -> bool {
    nodes[LANES - 1] == nodes[0] + LANES - 1
}

impl Loops for PressNodes<'_> {
    type Output = PressedNodes;

    #[inline(always)]
    fn run(mut self) -> PressedNodes {
        let mut pressed = PressedLanes::NONE;
        for (index, chunk) in self.nodes.chunks(LANES).enumerate() {
            self.take(index * LANES, chunk, &mut pressed);
        }
        pressed.sum()
    }
}

impl PressNodes<'_> {
    #[inline(always)]
    fn take(&mut self, first: usize, chunk: &[u32], pressed: &mut PressedLanes) {
        let substep = self.substep;
        let part_out = pushed_out(substep);
        let mut nodes = [chunk[0] as usize; LANES];
        for (node, &of_chunk) in nodes.iter_mut().zip(chunk) {
            *node = of_chunk as usize;
        }
        let positions = gathered(self.positions, &nodes);
        let met = match self.solid {
            PressingSolid::Round { segment, spin } => self.meet_round((chunk, &nodes), &positions, &segment, spin),
            PressingSolid::Mesh {
                planes,
                slot,
                from,
                to,
                flat,
            } => self.meet_planes(
                (chunk, &nodes),
                &positions,
                (&planes[first..], slot),
                [&from, &to],
                flat,
            ),
        };
        let Some(MetLanes {
            gap,
            normal,
            surface_velocity,
            arm,
            touches,
        }) = met
        else {
            return;
        };
        let velocities = gathered(self.velocities.each_ref().map(|axis| &**axis), &nodes);
        let answers = self.answers(&nodes);
        let speed = dot(&velocities, &normal);
        let of_surface = dot(&surface_velocity, &normal);
        let per_substep = 1.0 / substep;
        let impulse = each(|lane| {
            let least = of_surface[lane] - gap[lane].max(0.0) * per_substep;
            ((least - speed[lane]) / answers[lane]).max(0.0)
        });
        let slip = vectors(|k, lane| {
            let across = speed[lane] - of_surface[lane];
            velocities[k][lane] - surface_velocity[k][lane] - normal[k][lane] * across
        });
        let slips = dot(&slip, &slip);
        let friction = each(|lane| {
            let most = self.friction * impulse[lane] * answers[lane];
            let slip = slips[lane].sqrt();
            if slip > most { most / slip } else { 1.0 }
        });
        let gives = |lane: usize| touches[lane] && impulse[lane] > 0.0;
        let holds = self.friction > 0.0;
        let change = vectors(|k, lane| {
            let across = if holds { slip[k][lane] * friction[lane] } else { 0.0 };
            normal[k][lane] * (impulse[lane] * answers[lane]) - across
        });
        let given = vectors(|k, lane| {
            if gives(lane) {
                change[k][lane] / answers[lane]
            } else {
                0.0
            }
        });
        let turned = vectors(|k, lane| {
            let [i, j] = [(k + 1) % 3, (k + 2) % 3];
            if gives(lane) {
                arm[i][lane] * given[j][lane] - arm[j][lane] * given[i][lane]
            } else {
                0.0
            }
        });
        for k in 0..3 {
            for lane in 0..LANES {
                pressed.impulse[k][lane] += f64::from(given[k][lane]);
                pressed.angular_impulse[k][lane] += f64::from(turned[k][lane]);
            }
        }

        let depth = each(|lane| if touches[lane] { (-gap[lane]).max(0.0) } else { 0.0 });
        if is_run(&nodes) {
            let first = nodes[0];
            for k in 0..3 {
                let after = &mut self.velocities[k][first..first + LANES];
                let next = &mut self.next_positions[k][first..first + LANES];
                let (low, high) = (&mut pressed.low[k], &mut pressed.high[k]);
                for lane in 0..LANES {
                    let velocity = velocities[k][lane] + change[k][lane];
                    let moved = positions[k][lane] + velocity * substep;
                    let is_given = gives(lane);
                    after[lane] = if is_given { velocity } else { after[lane] };
                    let moved = if is_given { moved } else { next[lane] };
                    let out = normal[k][lane] * (part_out * depth[lane]);
                    next[lane] = if depth[lane] > 0.0 { moved + out } else { moved };
                    low[lane] = if is_given { velocity.min(low[lane]) } else { low[lane] };
                    high[lane] = if is_given { velocity.max(high[lane]) } else { high[lane] };
                }
            }
            return;
        }
        for lane in 0..chunk.len() {
            let is_given = gives(lane);
            if !touches[lane] || !is_given && gap[lane] >= 0.0 {
                continue;
            }
            let node = nodes[lane];
            for k in 0..3 {
                if is_given {
                    let velocity = velocities[k][lane] + change[k][lane];
                    self.velocities[k][node] = velocity;
                    self.next_positions[k][node] = positions[k][lane] + velocity * substep;
                    pressed.low[k][lane] = velocity.min(pressed.low[k][lane]);
                    pressed.high[k][lane] = velocity.max(pressed.high[k][lane]);
                }
                if depth[lane] > 0.0 {
                    self.next_positions[k][node] += normal[k][lane] * (part_out * depth[lane]);
                }
            }
        }
    }

    /// The change of velocity of each node for an impulse, 1/kg.
    #[inline(always)]
    fn answers(&self, nodes: &[usize; LANES]) -> Sixteen {
        let inverse_masses = each(|lane| self.inverse_masses[nodes[lane]]);
        match self.damping {
            None => inverse_masses,
            Some(NodeDamping { gain, loss, .. }) => {
                each(|lane| inverse_masses[lane] * (gain[nodes[lane]] * (2.0 - loss[nodes[lane]]) / self.substep))
            }
        }
    }

    #[inline(always)]
    fn meet_round(
        &mut self,
        (chunk, nodes): (&[u32], &[usize; LANES]),
        positions: &[Sixteen; 3],
        segment: &Segment,
        spin: Vec3,
    ) -> Option<MetLanes> {
        let (radius, around) = (segment.radius, segment.radius + self.thickness);
        let [a, b] = segment.ends.map(|end| end.to_array());
        let [first, last] = segment.steps.map(|step| step.to_array());
        let axis = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
        // No branch here: compilers take what is the same for all nodes out of the loop over them, also where there is no segment.
        let per_square = 1.0 / square.max(f32::MIN_POSITIVE);
        let from_a = vectors(|k, lane| positions[k][lane] - a[k]);
        let along = each(|lane| {
            let part = from_a[0][lane] * axis[0] + from_a[1][lane] * axis[1] + from_a[2][lane] * axis[2];
            (part * per_square).clamp(0.0, 1.0)
        });
        let offset = vectors(|k, lane| from_a[k][lane] - axis[k] * along[lane]);
        let squares = dot(&offset, &offset);
        let touching = around * (1.0 + TOUCHING);
        let reach = touching + self.closing;
        let nearest = squares.iter().copied().fold(f32::INFINITY, f32::min);
        if !(nearest <= reach * reach) {
            return None;
        }
        let distance = each(|lane| squares[lane].sqrt());
        let normal = vectors(|k, lane| offset[k][lane] / distance[lane]);
        let step = vectors(|k, lane| first[k] + (last[k] - first[k]) * along[lane]);
        // Behind the plane across the normal nothing of the tool is nearer than its further end goes.
        let ahead = each(|lane| {
            let of = |step: [f32; 3]| step[0] * normal[0][lane] + step[1] * normal[1][lane] + step[2] * normal[2][lane];
            of(first).max(of(last))
        });
        let velocities = gathered(self.velocities.each_ref().map(|axis| &**axis), nodes);
        let speed = dot(&velocities, &normal);
        let inverse_masses = each(|lane| self.inverse_masses[nodes[lane]]);
        let (mut touches, mut may_touch) = ([false; LANES], [false; LANES]);
        for lane in 0..LANES {
            let is_free = inverse_masses[lane] > 0.0 && lane < chunk.len();
            let comes_to = distance[lane] + (speed[lane] * self.substep - ahead[lane]).min(0.0);
            touches[lane] = is_free && distance[lane] <= touching && distance[lane] > 0.0;
            may_touch[lane] = is_free && !touches[lane] && comes_to <= touching;
        }
        if may_touch.contains(&true) {
            let undecided = chunk.iter().zip(may_touch).filter(|&(_, may_touch)| may_touch);
            self.undecided.extend(undecided.map(|(&node, _)| node));
        }
        let (spin, centre) = (spin.to_array(), self.centre.to_array());
        let surface = vectors(|k, lane| normal[k][lane] * radius);
        let per_substep = 1.0 / self.substep;
        Some(MetLanes {
            gap: each(|lane| distance[lane] - around),
            normal,
            surface_velocity: vectors(|k, lane| {
                let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                step[k][lane] * per_substep + (spin[i] * surface[j][lane] - spin[j] * surface[i][lane])
            }),
            arm: vectors(|k, lane| a[k] + axis[k] * along[lane] + step[k][lane] + surface[k][lane] - centre[k]),
            touches,
        })
    }

    #[inline(always)]
    fn meet_planes(
        &mut self,
        (chunk, nodes): (&[u32], &[usize; LANES]),
        positions: &[Sixteen; 3],
        (planes, slot): (&[NearestPlane], u32),
        [from, to]: [&Placement; 2],
        flat: f32,
    ) -> Option<MetLanes> {
        let near = self.thickness + self.closing;
        let last = chunk.len() - 1;
        let plane = |lane: usize| &planes[lane.min(last)];
        let back = columns(from.orientation.conjugate());
        let there = columns(from.orientation);
        let centre = from.centre.to_array();
        let from_centre = vectors(|k, lane| positions[k][lane] - centre[k]);
        let own = turned(&back, &from_centre);
        let own_normal = vectors(|k, lane| plane(lane).normal[k]);
        let moved = vectors(|k, lane| own[k][lane] - plane(lane).point[k]);
        let along = dot(&own_normal, &moved);
        let distance = each(|lane| plane(lane).distance + along[lane]);
        let ways = dot(&moved, &moved);
        let mut touches = [false; LANES];
        for (lane, &node) in chunk.iter().enumerate() {
            let is_free = self.inverse_masses[node as usize] > 0.0;
            let is_known = plane(lane).slot == slot;
            let is_flat = is_known && plane(lane).normal != Vec3::ZERO && ways[lane] <= flat * flat;
            let is_far = is_known && !is_flat && plane(lane).distance - ways[lane].sqrt() > near;
            touches[lane] = is_free && is_flat && distance[lane] <= near;
            if is_free && !is_flat && !is_far {
                self.undecided.push(node);
            }
        }
        if !touches.iter().any(|&touches| touches) {
            return None;
        }
        let normal = turned(&there, &own_normal);
        let velocities = gathered(self.velocities.each_ref().map(|axis| &**axis), nodes);
        // The solid's matter at the surface goes where the solid takes it.
        let turn = columns(to.orientation * from.orientation.conjugate());
        let surface = vectors(|k, lane| from_centre[k][lane] - normal[k][lane] * distance[lane]);
        let turned_surface = turned(&turn, &surface);
        let shift = (to.centre - from.centre).to_array();
        let is_still = from.orientation == to.orientation;
        let step = vectors(|k, lane| {
            let turned = if is_still {
                0.0
            } else {
                turned_surface[k][lane] - surface[k][lane]
            };
            shift[k] + turned
        });
        let far = vectors(|k, lane| velocities[k][lane] * self.substep - step[k][lane]);
        let far = dot(&far, &far);
        for (lane, &node) in chunk.iter().enumerate() {
            if touches[lane] && far[lane] > flat * flat {
                touches[lane] = false;
                self.undecided.push(node);
            }
        }
        let per_substep = 1.0 / self.substep;
        let position = self.centre.to_array();
        Some(MetLanes {
            gap: each(|lane| distance[lane] - self.thickness),
            normal,
            surface_velocity: vectors(|k, lane| step[k][lane] * per_substep),
            arm: vectors(|k, lane| centre[k] + surface[k][lane] + step[k][lane] - position[k]),
            touches,
        })
    }
}

/// The columns of a turn.
fn columns(turn: Quat) -> [[f32; 3]; 3] {
    Mat3::from_quat(turn).to_cols_array_2d()
}

#[inline(always)]
fn turned(columns: &[[f32; 3]; 3], of: &[Sixteen; 3]) -> [Sixteen; 3] {
    let [x, y, z] = columns;
    vectors(|k, lane| x[k] * of[0][lane] + y[k] * of[1][lane] + z[k] * of[2][lane])
}
