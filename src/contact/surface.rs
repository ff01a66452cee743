//! Surface changes while tools are near, for example by a cut. A change takes time in proportion to its size.

use super::contacts::Contacts;
use crate::base::Result;
use crate::nodes::Bindings;
use crate::soa::Vectors;

/// A change of a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceChange<'a> {
    /// Triangles with new corners, each once, by their indices.
    pub changed: &'a [(u32, [u32; 3])],
    /// Triangles that are appended.
    pub added: &'a [[u32; 3]],
    /// Nodes that are neither drawn nor touched, for example virtual nodes. Corners of the triangles above are visible
    /// even if they are listed here.
    pub hidden: &'a [u32],
}

impl Contacts {
    /// Reserves memory for a change that adds `nodes` nodes, changes `changed` triangles and adds `added` triangles.
    pub fn reserve_surface(&mut self, nodes: usize, changed: usize, added: usize) -> Result<()> {
        self.features.reserve(changed, added)?;
        // Each triangle adds itself, its edges and its corners.
        let new_count = nodes + 7 * (changed + added);
        let features = self.features.count() + nodes + 4 * (changed + added);
        self.new_features.clear();
        self.new_features.try_reserve(new_count)?;
        let node_count = self.features.node_count as usize + nodes;
        self.candidates.reserve_features(features, node_count)?;
        let tools = self.touched.len();
        self.reserve_contacts(features, tools)
    }

    /// Applies a change of the surface. Its memory is reserved. `body_index` maps the caller's indices to those of the
    /// body. `bindings` already includes the new hidden nodes. `revealed` lists nodes that were hidden before and are
    /// visible now.
    pub fn change_surface(
        &mut self,
        change: &SurfaceChange,
        revealed: impl Iterator<Item = u32>,
        body_index: impl Fn(u32) -> u32,
        (positions, bindings): (&Vectors, &Bindings),
    ) {
        let Self {
            features, new_features, ..
        } = self;
        let previous_counts = features.counts();
        let [previous_nodes, _, first_added] = previous_counts;
        let node_count = positions.len() as u32;
        features.node_count = node_count;
        new_features.clear();
        new_features.extend(revealed.filter(|&node| node < previous_nodes));
        new_features.extend((previous_nodes..node_count).filter(|&node| !bindings.is_hidden(node)));
        for &(index, corners) in change.changed {
            let removed = features.face(index as usize);
            features.set_face(index as usize, corners.map(&body_index), |edge| {
                new_features.push(node_count + edge)
            });
            features.drop_edges_of(removed);
        }
        for (index, &corners) in (first_added as usize..).zip(change.added) {
            features.set_face(index, corners.map(&body_index), |edge| {
                new_features.push(node_count + edge)
            });
        }
        let [_, edge_count, face_count] = features.counts();
        let first_face = node_count + edge_count;
        new_features.extend(change.changed.iter().map(|&(index, _)| first_face + index));
        new_features.extend((first_added..face_count).map(|index| first_face + index));
        self.candidates.apply_change(
            &self.features,
            previous_counts,
            &mut self.new_features,
            (positions, bindings),
        );
    }
}
