//! The scenes: each a discrete model that every engine receives node by node.

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

/// A model with its name and the measure of its motion.
pub struct Scene {
    pub name: &'static str,
    /// A one-line description.
    pub about: String,
    pub model: Model,
    pub measure: Measure,
}

/// The measured quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Positions at the end of each frame, as a check of a player before it is timed.
    Check,
    /// Positions at the end of each frame.
    Motion,
    /// Positions at the last frame, when a damped body is at rest.
    Rest,
    /// Depth of nodes in obstacles at the end of frames, relative to this size [m]. There is no reference.
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
