//! The project around the library: header and bindings, C and C++ programs, packages, documents, and the layers of the
//! source.

#[path = "../support/mod.rs"]
mod support;

mod abi;
mod c_programs;
mod cxx;
mod engines;
mod examples;
mod header;
mod install;
mod layering;
mod names;
mod readme;
mod samples;
mod symbols;
mod web;
mod words;
