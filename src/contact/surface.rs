//! A surface that changes while tools are near, as where it is cut: what the change costs does not depend on the rest of it.

use super::contacts::Contacts;
use crate::base::Result;
use crate::nodes::Bindings;
use crate::soa::Vectors;

/// How a surface changes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SurfaceChange<'a> {
    /// Triangles that have other corners now, each once, by their numbers.
    pub changed: &'a [(u32, [u32; 3])],
    /// Those that follow the last.
    pub added: &'a [[u32; 3]],
    /// Nodes that are neither drawn nor touched, as copies are for the material of others. Corners of the triangles above are, and may be
    /// among them.
    pub hidden: &'a [u32],
}

impl Contacts {
    /// Makes room for a change in which so many nodes come, and so many triangles change and are added.
    pub fn reserve_surface(&mut self, nodes: usize, changed: usize, added: usize) -> Result<()> {
        self.features.reserve(changed, added)?;
        // Each triangle with its edges and corners.
        let fresh = nodes + 7 * (changed + added);
        let features = self.features.count() + nodes + 4 * (changed + added);
        self.fresh.clear();
        self.fresh.try_reserve(fresh)?;
        let node_count = self.features.node_count as usize + nodes;
        self.candidates.reserve_features(features, node_count)?;
        let tools = self.touched.len();
        self.reserve_together(features, tools)
    }

    /// The surface changes, for which there is room; `own` makes the caller's numbers the body's, of which the bindings know already which
    /// are hidden. `shown` were so before, and are not now.
    pub fn change_surface(
        &mut self,
        change: &SurfaceChange,
        shown: impl Iterator<Item = u32>,
        own: impl Fn(u32) -> u32,
        (positions, bindings): (&Vectors, &Bindings),
    ) {
        let Self { features, fresh, .. } = self;
        let before = features.counts();
        let [known, _, first_added] = before;
        let node_count = positions.len() as u32;
        features.node_count = node_count;
        fresh.clear();
        fresh.extend(shown.filter(|&node| node < known));
        fresh.extend((known..node_count).filter(|&node| !bindings.is_hidden(node)));
        for &(index, corners) in change.changed {
            let gone = features.face(index as usize);
            features.set_face(index as usize, corners.map(&own), |edge| fresh.push(node_count + edge));
            features.drop_edges_of(gone);
        }
        for (index, &corners) in (first_added as usize..).zip(change.added) {
            features.set_face(index, corners.map(&own), |edge| fresh.push(node_count + edge));
        }
        let [_, edge_count, face_count] = features.counts();
        let first_face = node_count + edge_count;
        fresh.extend(change.changed.iter().map(|&(index, _)| first_face + index));
        fresh.extend((first_added..face_count).map(|index| first_face + index));
        self.candidates
            .change(&self.features, before, &mut self.fresh, (positions, bindings));
    }
}
