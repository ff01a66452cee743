//! Recordings of a world in a file, and their replay: the state before each step, and the hash of the state after it.
//!
//! Calls between two steps are not recorded one by one, but as the difference that they make to the snapshot of the
//! world. This covers every call, keeps ids, and records haptic handles as poses. The file format is
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`VERSION`] |
//! | | frames, two for each step |
//!
//! | frame at the begin of a step | frame at its end |
//! |---|---|
//! | 1 byte: [`BEGIN`] | 1 byte: [`END`] |
//! | 4 bytes: `dt`, f32 | 1 byte: 1 if the step was refused, else 0 |
//! | 4 bytes: the work budget, u32 | 8 bytes: the state hash |
//! | 8 bytes: length of the snapshot | |
//! | 8 bytes: length of the difference | |
//! | the [`difference`] to the snapshot after the last step | |
//!
//! All numbers are little-endian. If the program ends within a step, the file ends with the frame of its begin.

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
    /// The snapshots after the last step and before the next.
    before: Vec<u8>,
    now: Vec<u8>,
    /// The next frame; before the first step the head of the file.
    frame: Vec<u8>,
    steps: u64,
    /// The error that ended the recording.
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
        // The first frame follows the head of the file.
        if self.steps > 0 {
            self.frame.clear();
        }
        append(&mut self.frame, &[BEGIN])?;
        append(&mut self.frame, &dt.to_le_bytes())?;
        append(&mut self.frame, &world.work.to_le_bytes())?;
        append(&mut self.frame, &(self.now.len() as u64).to_le_bytes())?;
        let length_at = self.frame.len();
        append(&mut self.frame, &[0; 8])?;
        difference(&self.before, &self.now, &mut self.frame)?;
        let length = (self.frame.len() - length_at - 8) as u64;
        self.frame[length_at..length_at + 8].copy_from_slice(&length.to_le_bytes());
        self.write()
    }

    pub(super) fn end(&mut self, world: &World, is_refused: bool) -> Result<()> {
        world.save_again(&mut self.before)?;
        self.frame.clear();
        append(&mut self.frame, &[END, u8::from(is_refused)])?;
        append(&mut self.frame, &world.state_hash().to_le_bytes())?;
        self.write()?;
        self.steps += 1;
        Ok(())
    }
}

/// Appends bytes; fails if memory runs out.
fn append(to: &mut Vec<u8>, bytes: &[u8]) -> Result<()> {
    to.try_reserve(bytes.len())?;
    to.extend_from_slice(bytes);
    Ok(())
}

impl World {
    /// Records all steps from the next one on into a file, for [`World::replay`]: the first snapshot, the changes
    /// before each step, and the hash of the state after it. An existing file is replaced.
    ///
    /// Recording takes two snapshots per step and keeps two in memory. A recorded step writes to the file and can
    /// allocate. If writing fails or memory runs out, the recording ends and steps continue; [`World::stop_recording`]
    /// returns the error.
    ///
    /// # Errors
    /// [`Error::Io`]: the file cannot be created. [`Error::InvalidArgument`]: the world is already being recorded.
    /// [`Error::OutOfMemory`].
    pub fn start_recording(&mut self, path: &Path) -> Result<()> {
        ensure!(self.recorder.is_none(), "world is recorded already: stop that first");
        let mut frame = Vec::new();
        append(&mut frame, &MAGIC)?;
        append(&mut frame, &VERSION.to_le_bytes())?;
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

    /// Ends a recording and returns the number of steps in the file.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the world is not being recorded. [`Error::Io`], [`Error::OutOfMemory`]: the
    /// recording ended earlier; the file has the steps until then. In every case recording is off afterwards.
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

    /// Calls `write` with the recorder, if there is one.
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
