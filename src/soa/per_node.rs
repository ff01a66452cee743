//! Arrays with one entry per node: a common interface to reserve capacity and to grow.

use crate::base::{Result, memory};

/// Data with one entry per node. Reserving capacity can fail; growing within it cannot.
pub(crate) trait PerNode {
    /// Reserves capacity for `count` nodes in all.
    fn reserve_nodes(&mut self, count: usize) -> Result<()>;

    /// Adds nodes within the capacity, up to `count` in all.
    fn grow(&mut self, count: usize);
}

impl<T: Clone + Default> PerNode for Vec<T> {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        memory::reserve(self, count)
    }

    fn grow(&mut self, count: usize) {
        self.resize(count, T::default());
    }
}

impl<T: PerNode> PerNode for Option<T> {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.iter_mut().try_for_each(|it| it.reserve_nodes(count))
    }

    fn grow(&mut self, count: usize) {
        self.iter_mut().for_each(|it| it.grow(count));
    }
}

impl<T: PerNode, const COUNT: usize> PerNode for [T; COUNT] {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.iter_mut().try_for_each(|it| it.reserve_nodes(count))
    }

    fn grow(&mut self, count: usize) {
        self.iter_mut().for_each(|it| it.grow(count));
    }
}

impl<T: PerNode + ?Sized> PerNode for Box<T> {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        (**self).reserve_nodes(count)
    }

    fn grow(&mut self, count: usize) {
        (**self).grow(count);
    }
}

/// Implements [`PerNode`] from lists of per-node and per-tile fields:
/// `per_node! { Name { of, nodes } tiles { of, tiles } }`.
macro_rules! per_node {
    ($name:ty { $($field:tt),* $(,)? } $(tiles { $($tiles:ident),* })?) => {
        impl $crate::soa::PerNode for $name {
            fn reserve_nodes(&mut self, _count: usize) -> $crate::base::Result<()> {
                $($crate::soa::PerNode::reserve_nodes(&mut self.$field, _count)?;)*
                $($($crate::soa::PerNode::reserve_nodes(&mut self.$tiles, $crate::soa::tile_count(_count))?;)*)?
                Ok(())
            }

            fn grow(&mut self, _count: usize) {
                $($crate::soa::PerNode::grow(&mut self.$field, _count);)*
                $($($crate::soa::PerNode::grow(&mut self.$tiles, $crate::soa::tile_count(_count));)*)?
            }
        }
    };
}

pub(crate) use per_node;
