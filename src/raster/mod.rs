//! One depth-buffer rasteriser, for pictures and for contact in image space.
