//! Replays a recording and compares the state after each step.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use super::super::World;
use super::difference::apply;
use super::{BEGIN, END, MAGIC, VERSION};
use crate::base::{Error, Result, ensure, memory};
use crate::codec::seal;

/// The result of a replay.
///
/// ```
#[doc = include_str!("../../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # world.create_body(&cloth)?;
/// # let path = std::env::temp_dir().join(format!("sinew_replay_report_{}", std::process::id()));
/// world.start_recording(&path)?;
/// world.step(1.0 / 60.0)?;
/// world.stop_recording()?;
/// let report = World::replay(&path, 1)?;
/// assert_eq!((report.steps, report.difference, report.is_cut_short), (1, None, false));
/// # std::fs::remove_file(&path).expect("the file");
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReplayReport {
    /// The number of steps whose states equal the recorded ones.
    pub steps: u64,
    /// The first difference, which ends the replay.
    pub difference: Option<ReplayDifference>,
    /// True if the file ends within a step, for example because the program crashed.
    pub is_cut_short: bool,
}

/// The first difference between a replay and its recording.
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let path = std::env::temp_dir().join(format!("sinew_replay_difference_{}", std::process::id()));
/// # world.start_recording(&path)?;
/// # world.step(1.0 / 60.0)?;
/// # world.stop_recording()?;
/// if let Some(ReplayDifference { step, recorded, replayed }) = World::replay(&path, 1)?.difference {
///     panic!("step {step} came to {replayed:x} instead of {recorded:x}");
/// }
/// # std::fs::remove_file(&path).expect("the file");
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayDifference {
    /// The number of the step, from 1.
    pub step: u64,
    /// The recorded state hash after the step. It equals `replayed` if only one of the two steps was refused.
    pub recorded: u64,
    /// The state hash after the replayed step.
    pub replayed: u64,
}

/// The frame at the begin of a step.
struct StepBegin {
    /// s
    dt: f32,
    /// The work budget.
    work: u32,
    /// The length of the snapshot, bytes.
    size: usize,
    difference: Vec<u8>,
}

/// Reads the frames of a file.
struct FrameReader {
    file: BufReader<File>,
    name: String,
    /// The number of bytes left.
    left: u64,
}

impl FrameReader {
    fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let failed = |error| Error::Io(format!("{name}: {error}"));
        let file = File::open(path).map_err(failed)?;
        let left = file.metadata().map_err(failed)?.len();
        let mut frames = Self {
            file: BufReader::new(file),
            name: name.clone(),
            left,
        };
        let (magic, version) = (frames.array::<8>()?, frames.array::<4>()?);
        ensure!(magic == Some(MAGIC), "{name} is no recording");
        match version.map(u32::from_le_bytes) {
            Some(VERSION) => Ok(frames),
            other => Err(Error::Unsupported(format!(
                "{name} is a recording of version {}, this library reads {VERSION}",
                other.unwrap_or(0)
            ))),
        }
    }

    /// Reads the next bytes; `None` at the end of the file.
    fn fill(&mut self, bytes: &mut [u8]) -> Result<Option<()>> {
        match self.file.read_exact(bytes) {
            Ok(()) => {
                self.left = self.left.saturating_sub(bytes.len() as u64);
                Ok(Some(()))
            }
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(Error::Io(format!("{}: {error}", self.name))),
        }
    }

    fn array<const N: usize>(&mut self) -> Result<Option<[u8; N]>> {
        let mut bytes = [0; N];
        Ok(self.fill(&mut bytes)?.map(|()| bytes))
    }

    /// Reads the kind of the next frame and checks it; `None` at the end of the file.
    fn frame(&mut self, kind: u8) -> Result<Option<()>> {
        match self.array()? {
            None => Ok(None),
            Some([found]) if found == kind => Ok(Some(())),
            Some([found]) => Err(Error::invalid(format!(
                "{} is damaged: a frame of kind {found}, where {kind} was to come",
                self.name
            ))),
        }
    }

    /// Reads the frame at the begin of a step.
    fn begin(&mut self) -> Result<Option<StepBegin>> {
        let (Some(dt), Some(work), Some(size), Some(length)) =
            (self.array()?, self.array()?, self.array()?, self.array()?)
        else {
            return Ok(None);
        };
        let [size, length] = [size, length].map(u64::from_le_bytes);
        if length > self.left {
            return Ok(None);
        }
        let too_long = |_| Error::invalid(format!("{} is damaged: a snapshot of {size} bytes", self.name));
        let mut bytes = memory::filled(0, usize::try_from(length).map_err(too_long)?)?;
        let size = usize::try_from(size).map_err(too_long)?;
        Ok(self.fill(&mut bytes)?.map(|()| StepBegin {
            dt: f32::from_le_bytes(dt),
            work: u32::from_le_bytes(work),
            size,
            difference: bytes,
        }))
    }

    /// Reads the frame at the end of a step: whether it was refused, and the state hash.
    fn end(&mut self) -> Result<Option<(bool, u64)>> {
        if self.frame(END)?.is_none() {
            return Ok(None);
        }
        let (Some([refused]), Some(hash)) = (self.array()?, self.array()?) else {
            return Ok(None);
        };
        Ok(Some((refused != 0, u64::from_le_bytes(hash))))
    }
}

impl World {
    /// Replays a recording and compares the state after each step with the recorded one, until the first difference.
    /// `thread_count` is as in [`WorldDefinition`](crate::WorldDefinition). A last step without a recorded end is
    /// replayed too.
    ///
    /// The replay is bitwise identical with the version of the library and the SIMD level of the recording.
    ///
    /// # Errors
    /// [`Error::Io`]: the file cannot be read. [`Error::InvalidArgument`]: the file is not a recording or damaged, or
    /// `thread_count` is too large. [`Error::Unsupported`]: the recording is of another version of the library, or this
    /// processor does not support its SIMD level. [`Error::OutOfMemory`].
    pub fn replay(path: &Path, thread_count: u32) -> Result<ReplayReport> {
        let mut frames = FrameReader::open(path)?;
        let mut report = ReplayReport::default();
        let mut world: Option<World> = None;
        let mut before = Vec::new();
        while frames.frame(BEGIN)?.is_some() {
            let Some(begin) = frames.begin()? else {
                report.is_cut_short = true;
                break;
            };
            let mut bytes = apply(&before, &begin.difference, begin.size)?;
            // A loaded world can reserve other capacities than the recorded one, so the checksum is computed again. The
            // first snapshot is checked as it is.
            if !before.is_empty() {
                seal(&mut bytes);
            }
            // Without calls between two steps the world continues.
            let mut replayed_world = match world.take() {
                Some(replayed_world) if bytes == before => replayed_world,
                _ => World::load(&bytes, thread_count, None)?,
            };
            let result = replayed_world.step_of(begin.dt, begin.work);
            let Some((is_refused, recorded)) = frames.end()? else {
                report.is_cut_short = true;
                break;
            };
            let replayed = replayed_world.state_hash();
            if replayed != recorded || result.is_err() != is_refused {
                report.difference = Some(ReplayDifference {
                    step: report.steps + 1,
                    recorded,
                    replayed,
                });
                break;
            }
            report.steps += 1;
            replayed_world.save_again(&mut before)?;
            world = Some(replayed_world);
        }
        Ok(report)
    }
}
