//! What is made as small as it can be: `Phi(s) = sum (c s² / 2 - b s) + E(x + s)`, with E the energy of the springs.
//!
//! In a step of time t, c is `m/t² + gamma/t`, and b all forces that do not depend on s; at rest c is 0. Damping along springs
//! has such a function too as long as the directions of the springs are held: each iteration has its own.

use glam::{DMat3, DVec3};

use super::matrix::Matrix;
use super::network::{Element, Network, PAIRS, Tetrahedron};
use crate::base::{Result, memory, outer, trace};
use crate::codec::saved;
use crate::contact::Holds;
use crate::elements::Deformed;
use crate::nodes::Pins;
use crate::solver::held::without_held;
use crate::springs::Link;

/// The function, and where on it we are.
#[derive(Debug)]
pub(super) struct Equation {
    /// x: where nodes are without a way, m.
    pub anchors: Vec<DVec3>,
    /// s, m; 0 for nodes that are held.
    pub ways: Vec<DVec3>,
    /// c, N/m.
    pub inertia: Vec<f64>,
    /// b, N.
    pub loads: Vec<DVec3>,
    /// kg; 0 for nodes that are held.
    pub masses: Vec<f64>,
    /// Velocities without a way, m/s: for springs with damping alone.
    pub drifts: Vec<DVec3>,
    /// What tools do.
    pub holds: Holds,
    /// Lent by the body while it is solved: along the axes that a node is held along its way is 0.
    pub pins: Pins,
    /// What a way counts as a velocity, 1/s; 0: nothing is damped.
    pub rate: f64,
    /// Of the nodes where volume is kept by rings, Pa, at the ways of which forces and matrices were made last.
    pressures: Vec<f64>,
    /// There too, of each tetrahedron: how its volume grows with the place of each corner, m².
    areas: Vec<[DVec3; 4]>,
}

saved! { Equation { anchors, ways, inertia, loads, masses, drifts, holds, pins, rate, pressures, areas } }

/// What of the stiffness of rings stands in the factor, as a part of what it were if each tetrahedron kept its volume.
const PART_OF_RINGS: f32 = 0.05;

/// Which matrix is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tangent {
    /// All second derivatives.
    Exact,
    /// Without what pressed springs do sideways: positive semidefinite.
    Clamped,
    /// The same as far as it has the pattern of the network, to be factorised.
    Factor,
}

/// A spring where it is.
struct Spring {
    way: DVec3,
    length: f64,
    direction: DVec3,
    /// How fast it lengthens, m/s.
    speed: f64,
}

impl Equation {
    /// For so many nodes, rings, and tetrahedra in rings.
    pub fn new(node_count: usize, ring_count: usize, member_count: usize) -> Result<Self> {
        let vectors = || memory::filled(DVec3::ZERO, node_count);
        Ok(Self {
            anchors: vectors()?,
            ways: vectors()?,
            inertia: memory::filled(0.0, node_count)?,
            loads: vectors()?,
            masses: memory::filled(0.0, node_count)?,
            drifts: vectors()?,
            holds: Holds::default(),
            pins: Pins::default(),
            rate: 0.0,
            pressures: memory::filled(0.0, ring_count)?,
            areas: memory::reserved(member_count)?,
        })
    }

    #[inline(always)]
    pub fn is_free(&self, node: usize) -> bool {
        self.masses[node] > 0.0
    }

    /// The part of a node's vector along axes along which it is free to move.
    #[inline]
    pub fn free_part(&self, node: usize, vector: DVec3) -> DVec3 {
        if self.is_free(node) {
            DVec3::select(self.pins.partial_axes_of(node as u32), DVec3::ZERO, vector)
        } else {
            DVec3::ZERO
        }
    }

    #[inline(always)]
    pub fn position(&self, node: usize) -> DVec3 {
        self.anchors[node] + self.ways[node]
    }

    /// How far all nodes reach along an axis, m.
    pub fn extent(&self) -> f64 {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for node in 0..self.anchors.len() {
            low = low.min(self.position(node));
            high = high.max(self.position(node));
        }
        (high - low).max_element()
    }

    /// Minus the slope, N: what acts on each node, held ones too.
    pub fn residuals(&mut self, network: &Network, residuals: &mut [DVec3]) {
        self.find_pressures(network);
        for (node, residual) in residuals.iter_mut().enumerate() {
            *residual = self.loads[node] - self.ways[node] * self.inertia[node];
        }
        for (_, node, link) in network.springs() {
            let spring = self.spring(node, link);
            let pull = stiffness(link) * (spring.length - rest_length(link)) + damping(link) * spring.speed;
            let force = spring.direction * pull;
            residuals[node] += force;
            residuals[link.neighbour as usize] -= force;
        }
        for element in network.tetrahedra() {
            let tetrahedron = element.of;
            let deformed = self.deformed(&element).under_mean(&self.pressures, tetrahedron);
            for (corner, gradient) in tetrahedron.corners.into_iter().zip(tetrahedron.rest.gradients()) {
                residuals[corner] += deformed.force(gradient);
            }
        }
        let at = |node: usize| self.position(node);
        network
            .beside
            .show_forces(&at, &mut |node, force| residuals[node] += force);
        let way = |node: usize| self.ways[node];
        self.holds
            .show_forces(way, |node, force| residuals[node] += self.free_part(node, force));
    }

    /// How the function changes where the ways become longer by `part` of `corrections`, and the sum of what it changes by
    /// at single nodes and springs, without sign: J. Differences are never those of sums.
    pub fn change(&self, network: &Network, corrections: &[DVec3], part: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        let mut add = |change: f64| {
            sums[0] += change;
            sums[1] += change.abs();
        };
        for (node, &correction) in corrections.iter().enumerate() {
            let (way, inertia) = (correction * part, self.inertia[node]);
            add(way.dot(self.ways[node] * inertia - self.loads[node]) + 0.5 * inertia * way.length_squared());
        }
        for (_, node, link) in network.springs() {
            let neighbour = link.neighbour as usize;
            let spring = self.spring(node, link);
            let more = (corrections[neighbour] - corrections[node]) * part;
            let then = spring.way + more;
            let both = spring.length + then.length();
            if both > 0.0 {
                let longer = more.dot(spring.way + then) / both;
                add(0.5 * stiffness(link) * longer * (both - 2.0 * rest_length(link)));
            }
            let along = more.dot(spring.direction);
            add(0.5 * damping(link) * along * (2.0 * spring.speed + self.rate * along));
        }
        for element in network.tetrahedra() {
            let tetrahedron = element.of;
            let more = edges(&tetrahedron.corners, |node| corrections[node] * part);
            let [of_strain, of_volume, of_load, _] = self.deformed(&element).change(&tetrahedron.rest, more);
            add(of_strain);
            add(of_volume);
            add(of_load);
        }
        for node in 0..network.ring_count() {
            let (mut growth, mut more) = (0.0, 0.0);
            for element in network.ring(node) {
                let tetrahedron = element.of;
                let deformed = self.deformed(&element);
                growth += 0.25 * deformed.swelling();
                let longer = edges(&tetrahedron.corners, |node| corrections[node] * part);
                more += 0.25 * deformed.change(&tetrahedron.rest, longer)[3];
            }
            let volume = network.volumes[node];
            if volume > 0.0 {
                add(0.5 * network.kappa() / volume * more * (2.0 * growth + more));
                add(network.ring_load(node) * more);
            }
        }
        let (way, more) = (|node: usize| self.ways[node], |node: usize| corrections[node] * part);
        network
            .beside
            .show_changes(&|node| self.position(node), &more, &mut add);
        self.holds.show_changes(way, more, add);
        sums
    }

    /// The second derivatives, with `shift` (1/s²) times the mass added.
    pub fn assemble(&mut self, network: &Network, tangent: Tangent, shift: f64, matrix: &mut Matrix) {
        self.find_pressures(network);
        for (node, block) in matrix.diagonal.iter_mut().enumerate() {
            *block = if self.is_free(node) {
                DMat3::from_diagonal(DVec3::splat(self.inertia[node] + shift * self.masses[node]))
            } else {
                DMat3::IDENTITY
            };
        }
        matrix.beside.resize(network.pair_count(), DMat3::ZERO);
        for (place, node, link) in network.springs() {
            let neighbour = link.neighbour as usize;
            let block = self.stiffness_of(node, link, tangent);
            for end in [node, neighbour] {
                if self.is_free(end) {
                    matrix.diagonal[end] += block;
                }
            }
            let joins = self.is_free(node) && self.is_free(neighbour);
            matrix.beside[place] = if joins { -block } else { DMat3::ZERO };
        }
        for element in network.tetrahedra() {
            self.add_tetrahedron(element, tangent, matrix);
        }
        self.add_terms(network, tangent, matrix);
        if tangent == Tangent::Exact {
            self.add_pressure(network, matrix);
        }
        self.holds.show_blocks(|node, block| {
            if self.is_free(node) {
                matrix.diagonal[node] += whole(block);
            }
        });
        if self.pins.are_partial() {
            self.leave_out_held(network, matrix);
        }
    }

    /// Takes out of a matrix the rows and columns of axes that nodes are held along, but for the diagonal, which stays positive.
    fn leave_out_held(&self, network: &Network, matrix: &mut Matrix) {
        let held = |node: usize| self.pins.partial_axes_of(node as u32);
        for node in 0..network.node_count() {
            for place in network.row(node) {
                let nodes = [node, network.neighbour(place)];
                matrix.beside[place] = without_held(matrix.beside[place], nodes.map(held));
            }
        }
        for pin in self.pins.partial() {
            let block = &mut matrix.diagonal[pin.node as usize];
            *block = without_held(*block, [pin.axes; 2]);
            let size = trace(block);
            let size = if size > 0.0 { size } else { 1.0 };
            *block += DMat3::from_diagonal(DVec3::select(pin.axes, DVec3::splat(size), DVec3::ZERO));
        }
    }

    fn add_tetrahedron(&self, mut element: Element, tangent: Tangent, matrix: &mut Matrix) {
        let (law, tetrahedron) = (&mut element.law, element.of);
        if tangent == Tangent::Factor && law.rings {
            law.rings = false;
            law.kappa *= PART_OF_RINGS;
        }
        let deformed = self.deformed(&element);
        let gradients = tetrahedron.rest.gradients();
        let pressed = deformed.under_mean(&self.pressures, tetrahedron);
        let stiffness = |a: usize, b: usize| match tangent {
            Tangent::Exact => pressed.stiffness(gradients[a], gradients[b]),
            Tangent::Clamped | Tangent::Factor => deformed.clamped_stiffness(gradients[a], gradients[b]),
        };
        let corners = tetrahedron.corners;
        for corner in (0..4).filter(|&corner| self.is_free(corners[corner])) {
            matrix.diagonal[corners[corner]] += stiffness(corner, corner);
        }
        for ([a, b], place) in PAIRS.into_iter().zip(tetrahedron.places) {
            if self.is_free(corners[a]) && self.is_free(corners[b]) {
                let (high, low) = if corners[a] > corners[b] { (a, b) } else { (b, a) };
                matrix.beside[place] += stiffness(high, low);
            }
        }
    }

    fn add_terms(&self, network: &Network, tangent: Tangent, matrix: &mut Matrix) {
        let (at, is_exact) = (|node: usize| self.position(node), tangent == Tangent::Exact);
        network.beside.show_blocks(&at, is_exact, &mut |nodes, blocks| {
            if tangent == Tangent::Factor && nodes.len() > 2 {
                self.add_pairs(network, nodes, blocks, matrix);
                return;
            }
            for (a, &of_a) in nodes.iter().enumerate() {
                if !self.is_free(of_a as usize) {
                    continue;
                }
                matrix.diagonal[of_a as usize] += blocks[a][a];
                for (b, &of_b) in nodes.iter().enumerate() {
                    if of_b < of_a && self.is_free(of_b as usize) {
                        matrix.beside[network.place([of_a, of_b])] += blocks[a][b];
                    }
                }
            }
        });
    }

    /// Adds what pressure does as a surface turns. It draws one way as much as it pushes another: there is nothing of it that a matrix
    /// without negative curvature could have.
    fn add_pressure(&self, network: &Network, matrix: &mut Matrix) {
        let at = |node: usize| self.position(node);
        network.beside.show_pressure_blocks(&at, &mut |[a, b], block| {
            if self.is_free(a as usize) && self.is_free(b as usize) {
                matrix.beside[network.place([a, b])] += if a > b { block } else { block.transpose() };
            }
        });
    }

    /// Adds to a matrix that is to be factorised a term of several nodes, as springs between those that draw each other: of a matrix
    /// whose nodes push each other too an incomplete factor may be anything.
    fn add_pairs(&self, network: &Network, nodes: &[u32], blocks: &[[DMat3; 4]; 4], matrix: &mut Matrix) {
        for (a, &of_a) in nodes.iter().enumerate() {
            for (b, &of_b) in nodes[..a].iter().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|axis| blocks[a][b].col(axis)[axis]);
                let stiffness = -(x + y + z) / 3.0;
                if !(stiffness > 0.0) {
                    continue;
                }
                let block = DMat3::from_diagonal(DVec3::splat(stiffness));
                let ends = [of_a, of_b].map(|node| node as usize);
                for end in ends.into_iter().filter(|&end| self.is_free(end)) {
                    matrix.diagonal[end] += block;
                }
                if ends.into_iter().all(|end| self.is_free(end)) {
                    matrix.beside[network.place([of_a, of_b])] -= block;
                }
            }
        }
    }

    /// Brings the pressures of rings up to the ways, and what their changes depend on.
    fn find_pressures(&mut self, network: &Network) {
        if self.pressures.is_empty() {
            return;
        }
        self.pressures.fill(0.0);
        self.areas.clear();
        for element in network.tetrahedra() {
            let (deformed, tetrahedron) = (self.deformed(&element), element.of);
            for corner in tetrahedron.corners {
                self.pressures[corner] += 0.25 * deformed.swelling();
            }
            let areas = tetrahedron.rest.gradients().map(|gradient| deformed.area(gradient));
            self.areas.push(areas);
        }
        network.press(&mut self.pressures);
        for (node, pressure) in self.pressures.iter_mut().enumerate() {
            *pressure += network.ring_load(node);
        }
    }

    /// Adds to the products with a matrix what rings have beside it; `changes` are for the work.
    fn add_products_of_rings(&self, network: &Network, vectors: &[DVec3], products: &mut [DVec3], changes: &mut [f64]) {
        changes.fill(0.0);
        let tetrahedra = || network.tetrahedra().map(|element| element.of.corners).zip(&self.areas);
        for (corners, areas) in tetrahedra() {
            let grows = |(corner, area): (usize, &DVec3)| 0.25 * area.dot(vectors[corner]);
            let growth: f64 = corners.into_iter().zip(areas).map(grows).sum();
            for corner in corners {
                changes[corner] += growth;
            }
        }
        network.press(changes);
        for (corners, areas) in tetrahedra() {
            let change: f64 = corners.iter().map(|&corner| 0.25 * changes[corner]).sum();
            for (corner, area) in corners.into_iter().zip(areas) {
                products[corner] += self.free_part(corner, *area * change);
            }
        }
    }

    fn deformed(&self, element: &Element) -> Deformed {
        let edges = edges(&element.of.corners, |node| self.position(node));
        Deformed::new(element.law, &element.of.rest, edges).loaded(element.load)
    }

    /// Brings what contacts do up to the ways, of which the matrix is made.
    pub fn press(&mut self) {
        let ways = &self.ways;
        self.holds.press(|node| ways[node]);
    }

    /// Adds to the products with a matrix what contacts of several nodes have beside its diagonal, rings and volumes of
    /// cavities; `changes` has a number for each ring.
    pub fn add_products(&self, network: &Network, vectors: &[DVec3], products: &mut [DVec3], changes: &mut [f64]) {
        if !changes.is_empty() {
            self.add_products_of_rings(network, vectors, products, changes);
        }
        let at = |node: usize| self.position(node);
        network.beside.show_products(&at, vectors, &mut |node, product| {
            products[node] += self.free_part(node, product);
        });
        let vector = |node: usize| vectors[node];
        self.holds.show_products(vector, |node, product| {
            products[node] += self.free_part(node, product);
        });
        self.holds.show_blocks(|node, block| {
            products[node] -= self.free_part(node, whole(block) * vectors[node]);
        });
    }

    /// The matrix of a spring, `x n n^T + y I`.
    fn stiffness_of(&self, node: usize, link: &Link, tangent: Tangent) -> DMat3 {
        let Spring {
            length,
            direction,
            speed,
            ..
        } = self.spring(node, link);
        let (stiffness, rest_length) = (stiffness(link), rest_length(link));
        let mut across = if rest_length == 0.0 {
            stiffness
        } else if length > 0.0 {
            stiffness * (1.0 - rest_length / length)
        } else {
            // Where the ends coincide there is no side to be pushed to.
            0.0
        };
        if length > 0.0 {
            across += damping(link) * speed / length;
        }
        if tangent != Tangent::Exact {
            across = across.max(0.0);
        }
        let along = stiffness + damping(link) * self.rate - across;
        outer(direction, direction) * along + DMat3::from_diagonal(DVec3::splat(across))
    }

    /// The energy of springs, elements, terms, cavities and loads, J, with the origin of coordinates at `origin`.
    pub fn potential(&mut self, network: &Network, origin: DVec3) -> f64 {
        let elastic: f64 = network
            .springs()
            .map(|(_, node, link)| 0.5 * stiffness(link) * (self.spring(node, link).length - rest_length(link)).powi(2))
            .sum();
        let mut of_elements: f64 = network
            .tetrahedra()
            .map(|element| self.deformed(&element).energy())
            .sum();
        self.find_pressures(network);
        for (pressure, volume) in self.pressures.iter().zip(&network.volumes) {
            of_elements += 0.5 * pressure * pressure * volume / network.kappa();
        }
        let [of_terms, stored, work] = network.beside.energy(&|node| self.position(node));
        let loads = self.loads.iter().enumerate();
        elastic + of_elements + of_terms + stored
            - work
            - loads
                .map(|(node, load)| load.dot(self.position(node) + origin))
                .sum::<f64>()
    }

    #[inline(always)]
    fn spring(&self, node: usize, link: &Link) -> Spring {
        let neighbour = link.neighbour as usize;
        let way = self.position(neighbour) - self.position(node);
        let length = way.length();
        // Where both are at the same place it points along x, from the node with the lower number, which is the neighbour.
        let direction = if length > 0.0 { way / length } else { DVec3::NEG_X };
        let speed = if self.rate > 0.0 {
            let velocity =
                self.drifts[neighbour] - self.drifts[node] + (self.ways[neighbour] - self.ways[node]) * self.rate;
            velocity.dot(direction)
        } else {
            0.0
        };
        Spring {
            way,
            length,
            direction,
            speed,
        }
    }
}

impl Deformed {
    /// Under the mean of its nodes' pressures, where they have any, Pa.
    fn under_mean(self, pressures: &[f64], tetrahedron: &Tetrahedron) -> Self {
        if pressures.is_empty() {
            return self;
        }
        let pressures = tetrahedron.corners.map(|corner| 0.25 * pressures[corner]);
        self.under(pressures.iter().sum())
    }
}

/// The edges from the first of four corners to the others.
fn edges([a, b, c, d]: &[usize; 4], at: impl Fn(usize) -> DVec3) -> DMat3 {
    let first = at(*a);
    DMat3::from_cols(at(*b) - first, at(*c) - first, at(*d) - first)
}

fn stiffness(link: &Link) -> f64 {
    f64::from(link.stiffness)
}

fn rest_length(link: &Link) -> f64 {
    f64::from(link.rest_length)
}

fn damping(link: &Link) -> f64 {
    f64::from(link.damping)
}

fn whole([xx, yy, zz, yz, zx, xy]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
}
