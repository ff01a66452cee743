//! Vectors of nodes as records: three adjacent numbers need one load instead of three.

use super::TILE;
use super::per_node;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::simd::{Loops, Record};
use crate::threads::Tiles;

saved! { Record { 0 } }

/// One record per node.
#[derive(Debug)]
pub(crate) struct Records(Vec<Record>);

saved! { Records { 0 } }

per_node! { Records { 0 } }

impl Records {
    /// Creates `count` zero records.
    pub fn zeros(count: usize) -> Result<Self> {
        Ok(Self(memory::filled(Record::default(), count)?))
    }

    pub fn as_slice(&self) -> &[Record] {
        &self.0
    }

    pub fn as_mut_slice(&mut self) -> &mut [Record] {
        &mut self.0
    }

    pub fn tiles_mut(&mut self) -> Tiles<'_, Record> {
        Tiles::new(&mut self.0, TILE)
    }
}

/// Copies vectors to records.
pub(crate) struct WriteRecords<'a> {
    pub axes: [&'a [f32]; 3],
    pub records: &'a mut [Record],
}

impl Loops for WriteRecords<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let count = self.records.len();
        let [x, y, z] = self.axes.map(|axis| &axis[..count]);
        for (node, record) in self.records.iter_mut().enumerate() {
            *record = Record([x[node], y[node], z[node], 0.0]);
        }
    }
}
