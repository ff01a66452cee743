//! Overlap of two surfaces, without a world.

/// In image space: rays through the pixels of a parallel view (CInDeR; Halic et al., section 2.1).
pub mod image_space {
    pub use crate::contact::image_space::{
        EdgeInside, Form, ImageSpace, ImageSpaceDefinition, Inside, LayeredImage, Overlap, Placed, PointInside,
        Surface, Views,
    };
}

/// By exact tests of points, edges and triangles.
pub mod exact {
    pub use crate::contact::exact::overlap::{EdgeInside, Exact, Overlap, PointInside};
}

/// By signed distances sampled on a grid.
pub mod distance_field {
    pub use crate::contact::distance_field::DistanceField;
}
