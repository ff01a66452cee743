//! Recordings: what each step of a world began with, and the hash of what came of it, in a file; and their replay.
//!
//! What happens between two steps is not kept call by call, but as the difference that it made to the world's snapshot. So every call is
//! covered, also those of later versions, ids stay what they are, and what a haptic handle did is a pose like any other. A file is
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | | frames, two for each step |
//!
//! | frame of a step that begins | frame of one that is over |
//! |---|---|
//! | 1 byte: [`BEGIN`] | 1 byte: [`END`] |
//! | 4 bytes: `dt`, f32 | 1 byte: 1 where the step was refused, else 0 |
//! | 4 bytes: the units of work that it may do, u32 | 8 bytes: the state hash |
//! | 8 bytes: how long the snapshot is | |
//! | 8 bytes: how long the difference is | |
//! | the [`difference`] to the snapshot after the last step | |
//!
//! All numbers are little-endian. A step that ends the program leaves the frame that it began with.

mod difference;
mod player;

use std::fs::File;
use std::io::Write;
use std::path::Path;

use super::World;
use crate::base::{Error, Result, ensure, memory};
use difference::difference;
pub use player::{ReplayDifference, ReplayReport};

const MAGIC: [u8; 8] = *b"\x93sinewR\n";
const VERSION: u32 = 1;
const BEGIN: u8 = 1;
const END: u8 = 2;

/// A recording in progress.
#[derive(Debug)]
pub(super) struct Recorder {
    file: File,
    /// The snapshot after the last step, and the one that the next begins with.
    before: Vec<u8>,
    now: Vec<u8>,
    /// What is written next: before the first step, the head of the file.
    frame: Vec<u8>,
    steps: u64,
    /// Why it ended.
    failure: Option<Error>,
}

impl Recorder {
    fn write(&mut self) -> Result<()> {
        let steps = self.steps;
        let failed = |error| Error::Io(format!("the recording ended after {steps} steps: {error}"));
        self.file.write_all(&self.frame).map_err(failed)
    }

    pub(super) fn begin(&mut self, world: &World, dt: f32) -> Result<()> {
        world.save_again(&mut self.now)?;
        // The head of the file goes with the first.
        if self.steps > 0 {
            self.frame.clear();
        }
        put(&mut self.frame, &[BEGIN])?;
        put(&mut self.frame, &dt.to_le_bytes())?;
        put(&mut self.frame, &world.work.to_le_bytes())?;
        put(&mut self.frame, &(self.now.len() as u64).to_le_bytes())?;
        let length_at = self.frame.len();
        put(&mut self.frame, &[0; 8])?;
        difference(&self.before, &self.now, &mut self.frame)?;
        let length = (self.frame.len() - length_at - 8) as u64;
        self.frame[length_at..length_at + 8].copy_from_slice(&length.to_le_bytes());
        self.write()
    }

    pub(super) fn end(&mut self, world: &World, is_refused: bool) -> Result<()> {
        world.save_again(&mut self.before)?;
        self.frame.clear();
        put(&mut self.frame, &[END, u8::from(is_refused)])?;
        put(&mut self.frame, &world.state_hash().to_le_bytes())?;
        self.write()?;
        self.steps += 1;
        Ok(())
    }
}

/// Adds bytes, for which memory may run out.
fn put(to: &mut Vec<u8>, bytes: &[u8]) -> Result<()> {
    to.try_reserve(bytes.len())?;
    to.extend_from_slice(bytes);
    Ok(())
}

impl World {
    /// Records all steps from the next one on into a file, for [`World::replay`]: with the snapshot at the first, what changed before each, and
    /// the hash of the state after each. A file that exists is replaced.
    ///
    /// It takes two snapshots for each step and the memory of two of the largest. A step that is recorded writes to the file and may allocate. If the file
    /// cannot be written, or memory runs out, the recording ends, and steps go on: [`World::stop_recording`] tells.
    ///
    /// # Errors
    /// [`Error::Io`]: the file cannot be created. [`Error::InvalidArgument`]: the world is recorded already. [`Error::OutOfMemory`].
    pub fn start_recording(&mut self, path: &Path) -> Result<()> {
        ensure!(self.recorder.is_none(), "world is recorded already: stop that first");
        let mut frame = Vec::new();
        put(&mut frame, &MAGIC)?;
        put(&mut frame, &VERSION.to_le_bytes())?;
        let failed = |error| Error::Io(format!("{}: {error}", path.display()));
        let recorder = memory::boxed(Recorder {
            file: File::create(path).map_err(failed)?,
            before: Vec::new(),
            now: Vec::new(),
            frame,
            steps: 0,
            failure: None,
        })?;
        self.recorder = Some(recorder);
        Ok(())
    }

    /// Ends a recording: how many steps are in the file.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the world is not recorded. [`Error::Io`], [`Error::OutOfMemory`]: the recording ended before; the file
    /// holds the steps until then. The world is not recorded any more either way.
    pub fn stop_recording(&mut self) -> Result<u64> {
        let Some(mut recorder) = self.recorder.take() else {
            return Err(Error::invalid("world is not recorded"));
        };
        if recorder.steps == 0 && recorder.failure.is_none() {
            recorder.write()?;
        }
        match recorder.failure {
            None => Ok(recorder.steps),
            Some(failure) => Err(failure),
        }
    }

    /// Has the recorder write, where there is one.
    pub(super) fn record(&mut self, write: impl FnOnce(&mut Recorder, &World) -> Result<()>) {
        let Some(mut recorder) = self.recorder.take() else {
            return;
        };
        if recorder.failure.is_none() {
            recorder.failure = write(&mut recorder, self).err();
        }
        self.recorder = Some(recorder);
    }
}
