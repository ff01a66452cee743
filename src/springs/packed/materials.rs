//! The few kinds of spring that most of a body's springs are.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::def::{Rounding, Spring};
use crate::springs::kernels::SpringMaterial;

/// How many springs are looked at to find the kinds.
const SAMPLE: usize = 4096;

/// The share of the sample that a kind needs: with fewer springs of each, an entry in a table is no gain.
const SHARE: usize = 50;

/// A kind, and the rest lengths that are its own.
#[derive(Clone, Copy, Debug)]
struct MaterialKind {
    material: SpringMaterial,
    shortest: f32,
    longest: f32,
}

saved! { MaterialKind { material, shortest, longest } }

/// The kinds of spring in a body.
#[derive(Debug, Default)]
pub(super) struct Kinds {
    kinds: Vec<MaterialKind>,
}

saved! { Kinds { kinds } }

impl Kinds {
    /// The kinds that are common among `springs`.
    pub fn of(springs: &[Spring], rounding: Rounding) -> Result<Self> {
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
        let mut found = Self {
            kinds: memory::reserved(SHARE)?,
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
            if count * SHARE >= sample.len() {
                let (shortest, longest) = (first.rest_length, rest[count - 1].rest_length);
                let middle = 0.5 * (shortest + longest);
                // The sample may have missed the shortest and the longest.
                found.kinds.push(MaterialKind {
                    material: SpringMaterial {
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
        memory::shrink(&mut found.kinds)?;
        Ok(found)
    }

    /// Whether no kind is common.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The table that a spring's kind is a place in.
    pub fn materials(&self) -> Result<Vec<SpringMaterial>> {
        memory::collected(self.kinds.iter().map(|kind| kind.material))
    }

    /// Bytes held from the allocator.
    pub fn bytes(&self) -> usize {
        self.kinds.capacity() * size_of::<MaterialKind>()
    }

    /// The place of the kind that a spring is of by its definition; `None`: it is one of its own.
    #[inline]
    pub fn find(&self, own: &SpringMaterial) -> Option<u16> {
        self.place(|kind| {
            kind.material.stiffness == own.stiffness
                && kind.material.damping == own.damping
                && (kind.shortest..=kind.longest).contains(&own.rest_length)
        })
    }

    /// The place of the kind that has just these parameters.
    #[inline]
    pub fn find_exactly(&self, material: &SpringMaterial) -> Option<u16> {
        self.place(|kind| kind.material == *material)
    }

    fn place(&self, is: impl FnMut(&MaterialKind) -> bool) -> Option<u16> {
        self.kinds.iter().position(is).map(|place| place as u16)
    }
}
