//! Values of nodes and springs, and checks of lists from the caller.

use glam::Vec3;

use crate::base::{Error, Result, ensure, not_negative};

/// One value for all, or one for each.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let mut masses = vec![1e-4; mesh.positions.len()];
/// // The first node is pinned for good.
/// masses[0] = 0.0;
/// let body = world.create_body(&BodyDefinition { masses: Values::Each(&masses), ..cloth })?;
/// world.step(1.0 / 60.0)?;
/// assert_eq!(world.body(body)?.positions()[0], mesh.positions[0]);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values<'a> {
    /// The same value for all.
    Uniform(f32),
    /// A value for each, in order.
    Each(&'a [f32]),
}

impl Values<'_> {
    /// The value at `index`.
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Values::Uniform(value) => *value,
            Values::Each(values) => values[index],
        }
    }

    /// The common value; 0 if each has its own.
    pub(crate) fn uniform(&self) -> f32 {
        match self {
            Values::Uniform(value) => *value,
            Values::Each(_) => 0.0,
        }
    }

    /// True if every value is zero.
    pub(crate) fn all_zero(&self) -> bool {
        match self {
            Values::Uniform(value) => *value == 0.0,
            Values::Each(values) => values.iter().all(|&value| value == 0.0),
        }
    }
}

pub(crate) fn expect_count(name: &str, count: usize, expected: usize) -> Result<()> {
    ensure!(count == expected, "{name} has {count} entries: must have {expected}");
    Ok(())
}

pub(crate) fn finite_vector(name: &str, vector: Vec3) -> Result<()> {
    ensure!(vector.is_finite(), "{name} is {vector}: must be finite");
    Ok(())
}

pub(crate) fn finite_vectors(name: &str, vectors: &[Vec3]) -> Result<()> {
    for (node, vector) in vectors.iter().enumerate() {
        ensure!(vector.is_finite(), "{name}[{node}] is {vector}: must be finite");
    }
    Ok(())
}

/// Checks that each of `values` is finite and at least 0. `name` is in the singular.
pub(crate) fn check_values(name: &str, values: &Values, count: usize) -> Result<()> {
    match values {
        Values::Uniform(value) => not_negative(name, *value),
        Values::Each(values) => {
            let plural = plural(name);
            expect_count(&plural, values.len(), count)?;
            match values.iter().position(|&value| !(value >= 0.0 && value.is_finite())) {
                None => Ok(()),
                Some(index) => not_negative(&format!("{plural}[{index}]"), values[index]),
            }
        }
    }
}

/// Checks those values that are given.
pub(crate) fn check_given(given: [(&str, Option<Values>); 2], count: usize) -> Result<()> {
    let mut given = given.iter().filter_map(|(name, values)| Some((name, values.as_ref()?)));
    given.try_for_each(|(name, values)| check_values(name, values, count))
}

fn plural(name: &str) -> String {
    match name.strip_suffix("ss") {
        Some(_) => format!("{name}es"),
        None => format!("{name}s"),
    }
}

/// Checks that each element joins existing nodes, no node twice.
pub(crate) fn node_indices<const N: usize>(name: &str, elements: &[[u32; N]], nodes: usize) -> Result<()> {
    for (index, element) in elements.iter().enumerate() {
        for (corner, &node) in element.iter().enumerate() {
            ensure!(
                (node as usize) < nodes,
                "{name}[{index}] names node {node}: there are {nodes} nodes"
            );
            if element[..corner].contains(&node) {
                return Err(Error::invalid(format!("{name}[{index}] names node {node} twice")));
            }
        }
    }
    Ok(())
}
