//! Independent worlds, readers, embeddings, and sleeping tissue.

mod embedding;
mod ids;
mod many_worlds;
mod readers;
mod sleep;
