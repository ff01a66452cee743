//! Materials of tissue: springs, elements and terms, and changes of them.

mod enclosed;
mod laws;
mod meshes;
mod recovery;
mod region;
mod springs;
mod strain;
mod terms_analytic;
mod terms_forces;
mod terms_kernels;
mod terms_set;
mod tetrahedra;
mod theory;
mod tune;
mod viscosity;
