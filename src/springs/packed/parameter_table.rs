//! The table of spring parameters that many springs of a body share.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{Rounding, Spring};
use crate::springs::kernels::SpringParameters;

/// The number of sampled springs.
const SAMPLE: usize = 4096;

/// The maximum number of classes: a class needs at least one fiftieth of the sample. For fewer springs a table entry
/// does not pay off.
const MAX_CLASSES: usize = 50;

/// A class of springs: their shared parameters, and the rest lengths that belong to it.
#[derive(Clone, Copy, Debug)]
struct ParameterClass {
    entry: SpringParameters,
    shortest: f32,
    longest: f32,
}

saved! { ParameterClass { entry, shortest, longest } }

/// The classes of springs with shared parameters in a body.
#[derive(Debug, Default)]
pub(super) struct ParameterTable {
    classes: Vec<ParameterClass>,
}

saved! { ParameterTable { classes } }

impl ParameterTable {
    /// Finds the common classes among `springs`.
    pub fn new(springs: &[Spring], rounding: Rounding) -> Result<Self> {
        let mut sample: Vec<&Spring> = memory::reserved(SAMPLE.min(springs.len()))?;
        let count = SAMPLE.min(springs.len());
        sample.extend((0..count).map(|index| &springs[index * springs.len() / count]));
        let order = |a: &&Spring, b: &&Spring| {
            a.stiffness
                .total_cmp(&b.stiffness)
                .then(a.damping.total_cmp(&b.damping))
                .then(a.rest_length.total_cmp(&b.rest_length))
        };
        sample.sort_unstable_by(order);
        let mut table = Self {
            classes: memory::reserved(MAX_CLASSES)?,
        };
        let mut rest = &*sample;
        while let Some(first) = rest.first() {
            let width = rounding.width(first.rest_length);
            let same = |spring: &&Spring| {
                spring.stiffness == first.stiffness
                    && spring.damping == first.damping
                    && spring.rest_length - first.rest_length <= width
            };
            let count = rest.iter().take_while(|spring| same(spring)).count();
            if count * MAX_CLASSES >= sample.len() {
                let (shortest, longest) = (first.rest_length, rest[count - 1].rest_length);
                let middle = 0.5 * (shortest + longest);
                // The sample may have missed the shortest and the longest.
                table.classes.push(ParameterClass {
                    entry: SpringParameters {
                        stiffness: first.stiffness,
                        rest_length: middle,
                        damping: first.damping,
                    },
                    shortest: middle - 0.5 * width,
                    longest: middle + 0.5 * width,
                });
            }
            rest = &rest[count..];
        }
        memory::shrink(&mut table.classes)?;
        Ok(table)
    }

    /// True if there is no common class.
    pub fn is_empty(&self) -> bool {
        self.classes.is_empty()
    }

    /// The parameters of the classes, in order.
    pub fn table(&self) -> Result<Vec<SpringParameters>> {
        memory::collected(self.classes.iter().map(|class| class.entry))
    }

    /// Bytes held from the allocator.
    pub fn bytes(&self) -> usize {
        self.classes.capacity() * size_of::<ParameterClass>()
    }

    /// The index of the class that a spring belongs to. `None`: it needs its own parameters.
    #[inline]
    pub fn find(&self, own: &SpringParameters) -> Option<u16> {
        self.index_of(|class| {
            class.entry.stiffness == own.stiffness
                && class.entry.damping == own.damping
                && (class.shortest..=class.longest).contains(&own.rest_length)
        })
    }

    /// The index of the class with exactly these parameters.
    #[inline]
    pub fn find_exactly(&self, entry: &SpringParameters) -> Option<u16> {
        self.index_of(|class| class.entry == *entry)
    }

    fn index_of(&self, predicate: impl FnMut(&ParameterClass) -> bool) -> Option<u16> {
        self.classes.iter().position(predicate).map(|index_of| index_of as u16)
    }
}
