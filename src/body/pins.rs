//! Nodes that are held: where they are led, and the force it takes.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::error::Result;

/// A node that is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pin {
    pub node: u32,
    /// Where the next step leads it, in the caller's coordinates; `None`: it stays.
    pub target: Option<Vec3>,
    /// What holds it, mean over the last step, in newtons.
    pub force: Vec3,
    /// Where the step in progress leads it, in the body's coordinates, and the way there, in metres.
    pub goal: Vec3,
    pub travel: Vec3,
    /// The sum of the forces of the step in progress.
    pub force_sum: DVec3,
}

/// The pins of a body, in the order of their nodes.
#[derive(Debug, Default)]
pub(crate) struct Pins {
    pins: Vec<Pin>,
}

impl Pins {
    pub fn iter(&self) -> std::slice::Iter<'_, Pin> {
        self.pins.iter()
    }

    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Pin> {
        self.pins.iter_mut()
    }

    /// The pins of these nodes.
    pub fn within_mut(&mut self, nodes: &Range<usize>) -> &mut [Pin] {
        let first = self.pins.partition_point(|pin| (pin.node as usize) < nodes.start);
        let count = self.pins[first..].partition_point(|pin| (pin.node as usize) < nodes.end);
        &mut self.pins[first..first + count]
    }

    pub fn get(&self, node: u32) -> Option<&Pin> {
        self.find(node).ok().map(|index| &self.pins[index])
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut Pin> {
        self.find(node).ok().map(|index| &mut self.pins[index])
    }

    /// Holds `node`; nothing where it is held already.
    pub fn insert(&mut self, node: u32) -> Result<()> {
        if let Err(index) = self.find(node) {
            self.pins.try_reserve(1)?;
            let pin = Pin {
                node,
                target: None,
                force: Vec3::ZERO,
                goal: Vec3::ZERO,
                travel: Vec3::ZERO,
                force_sum: DVec3::ZERO,
            };
            self.pins.insert(index, pin);
        }
        Ok(())
    }

    /// Lets go of `node`; whether it was held.
    pub fn remove(&mut self, node: u32) -> bool {
        let found = self.find(node);
        if let Ok(index) = found {
            self.pins.remove(index);
        }
        found.is_ok()
    }

    fn find(&self, node: u32) -> std::result::Result<usize, usize> {
        self.pins.binary_search_by_key(&node, |pin| pin.node)
    }
}
