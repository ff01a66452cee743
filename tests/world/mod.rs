//! Worlds beside each other, their readers and embeddings, and tissue that sleeps.

mod embedding;
mod ids;
mod many_worlds;
mod readers;
mod sleep;
