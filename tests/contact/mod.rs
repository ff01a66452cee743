//! Contact: tools and tissue, tissue and tissue, grasping, detection.

mod attach_tissue;
mod candidates;
mod changed;
mod detection_exact;
mod doors;
mod dynamic;
mod friction;
mod grasp;
mod hard;
mod image_space;
mod limit;
mod mesh;
mod mesh_momentum;
mod mesh_refused;
mod mesh_sweep;
mod momentum;
mod node_by_node;
mod press;
mod query;
mod rest;
mod stop;
mod sutures;
mod sweep;
mod thin;
mod tissue_on_tools;
mod tissue_pairs;
