//! The cloth that every contender simulates, and its evaluation.

/// A falling square grid of nodes in the plane y = 0 with springs to all 8 neighbors, pinned along its first row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cloth {
    /// Nodes along one edge.
    pub side: u32,
    /// Distance of neighbors in a row or a column [m].
    pub spacing: f32,
    /// Mass of a node [kg].
    pub node_mass: f32,
    /// Stiffness of every spring [N/m].
    pub stiffness: f32,
    /// Gravity along -y [m/s²].
    pub gravity: f32,
    /// Duration of a step [s].
    pub step: f32,
}

impl Cloth {
    /// A sheet of 2.5 kg/m² on which steps of 1 ms are stable for sinew and the other explicit methods at all
    /// positions: a node with its 8 springs in one line allows 1.3 ms.
    pub fn new(side: u32) -> Self {
        Self {
            side,
            spacing: 0.02,
            node_mass: 1e-3,
            stiffness: 150.0,
            gravity: 9.81,
            step: 1e-3,
        }
    }

    /// The number of steps in one simulated second.
    pub fn steps_per_second(&self) -> usize {
        (1.0 / self.step).round() as usize
    }

    /// Command-line arguments, which [`Cloth::from_arguments`] reads.
    pub fn arguments(&self) -> Vec<String> {
        let numbers = [self.spacing, self.node_mass, self.stiffness, self.gravity, self.step];
        let mut arguments = vec![self.side.to_string()];
        arguments.extend(numbers.iter().map(f32::to_string));
        arguments
    }

    /// Parses the arguments of [`Cloth::arguments`].
    pub fn from_arguments(arguments: &[String]) -> Option<Self> {
        let (side, numbers) = arguments.split_first()?;
        let mut numbers = numbers.iter().map(|number| number.parse().ok());
        let mut next = || numbers.next().flatten();
        Some(Self {
            side: side.parse().ok()?,
            spacing: next()?,
            node_mass: next()?,
            stiffness: next()?,
            gravity: next()?,
            step: next()?,
        })
    }

    /// Initial positions, row by row.
    pub fn positions(&self) -> impl Iterator<Item = [f32; 3]> {
        let Self { side, spacing, .. } = *self;
        (0..side * side).map(move |node| [(node % side) as f32 * spacing, 0.0, (node / side) as f32 * spacing])
    }

    /// The pinned nodes.
    pub fn pinned(&self) -> std::ops::Range<u32> {
        0..self.side
    }

    /// The springs, each once: along rows, columns and both diagonals.
    pub fn springs(&self) -> impl Iterator<Item = [u32; 2]> {
        let side = self.side;
        (0..side * side).flat_map(move |node| {
            let right = node % side + 1 < side;
            let below = node / side + 1 < side;
            [
                right.then_some([node, node + 1]),
                below.then_some([node, node + side]),
                (right && below).then_some([node, node + side + 1]),
                (right && below).then_some([node + 1, node + side]),
            ]
            .into_iter()
            .flatten()
        })
    }

    /// Evaluates the stretch of the springs and the height of the sheet.
    pub fn shape(&self, position: impl Fn(u32) -> [f32; 3]) -> Shape {
        let position = |node: u32| position(node).map(f64::from);
        let spacing = f64::from(self.spacing);
        let (mut sum, mut max, mut count) = (0.0, f64::NEG_INFINITY, 0);
        for [a, b] in self.springs() {
            let straight = a / self.side == b / self.side || a % self.side == b % self.side;
            let rest = if straight { spacing } else { spacing * 2f64.sqrt() };
            let [a, b] = [position(a), position(b)];
            let square: f64 = (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum();
            let stretch = square.sqrt() / rest - 1.0;
            sum += stretch;
            max = f64::max(max, stretch);
            count += 1;
        }
        let nodes = self.side * self.side;
        let height: f64 = (0..nodes).map(|node| position(node)[1]).sum();
        Shape {
            mean_stretch: sum / f64::from(count),
            max_stretch: max,
            mean_height: height / f64::from(nodes),
        }
    }
}

/// The result of [`Cloth::shape`]. The mean is not finite if any node is not.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Mean over the springs of length / rest length - 1.
    pub mean_stretch: f64,
    /// Largest length / rest length - 1.
    pub max_stretch: f64,
    /// Mean height of the nodes [m], to check that all fell equally far.
    pub mean_height: f64,
}
