//! Placeholder.
use criterion::{Criterion, criterion_group, criterion_main};
fn step(_: &mut Criterion) {}
criterion_group!(benches, step);
criterion_main!(benches);
