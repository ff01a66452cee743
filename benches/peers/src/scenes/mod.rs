//! The scenes: each a discrete model that every engine is given, node by node.

mod cantilever;
mod cloth;
mod draped_cloth;
mod free_fall;
mod jelly;
mod mesh;
mod organ;
mod pressed_cloth;
mod rope;
mod sofa_beam;
mod stacked_blocks;

use crate::precision::model::Model;

pub use cantilever::tip_ratio;
pub use mesh::Block;
pub use sofa_beam::{SofaBeam, sofa_beams};

/// A model with its name and what is asked of its motion.
pub struct Scene {
    pub name: &'static str,
    /// A line for a reader.
    pub about: String,
    pub model: Model,
    pub measure: Measure,
}

/// Where an error is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// At the end of each frame, of what a player must get right before it is timed.
    Check,
    /// At the end of each frame.
    Motion,
    /// At the last frame, when a damped body rests.
    Rest,
    /// How deep nodes are in what they meet at the end of frames, in parts of this size, m. There is no reference.
    Contact { size: f64 },
}

/// All scenes, checks first.
pub fn all() -> Vec<Scene> {
    vec![
        free_fall::tetrahedra(),
        free_fall::springs(),
        cantilever::released(),
        cantilever::at_rest(),
        jelly::scene(),
        organ::scene(),
        cloth::scene(),
        rope::scene(),
        draped_cloth::scene(),
        pressed_cloth::scene(),
        stacked_blocks::two(),
        stacked_blocks::heap(),
    ]
}
