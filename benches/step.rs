//! Placeholder.
use criterion::{criterion_group, criterion_main, Criterion};
fn step(_: &mut Criterion) {}
criterion_group!(benches, step);
criterion_main!(benches);
