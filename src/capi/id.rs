//! Conversions between the ids of C and of Rust.

/// Gives an id of C its conversions to and from that of Rust.
macro_rules! converts {
    ($c:ident, $rust:ident) => {
        impl $c {
            pub(super) fn id(self) -> $rust {
                $rust(crate::base::SlotId {
                    index1: self.index1,
                    generation: self.generation,
                })
            }
        }

        impl From<$rust> for $c {
            fn from($rust(id): $rust) -> Self {
                Self {
                    index1: id.index1,
                    generation: id.generation,
                }
            }
        }
    };
}

pub(super) use converts;
