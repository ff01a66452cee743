//! A recording is replayed, and what comes of each step compared.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use super::super::World;
use super::difference::applied;
use super::{BEGIN, END, MAGIC, VERSION};
use crate::base::{Error, Result, ensure, memory};
use crate::codec::seal;

/// What came of a replay.
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
    /// How many steps were replayed with the states that were recorded.
    pub steps: u64,
    /// Where the replay was first other than the recording, and ended.
    pub difference: Option<ReplayDifference>,
    /// Whether the file ends within a step: the program or the disk did.
    pub is_cut_short: bool,
}

/// The first difference of a replay from its recording.
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
    /// Which step, counted from 1.
    pub step: u64,
    /// The state hash after it that was recorded, and that of the replay: the same where only one of the two was refused.
    pub recorded: u64,
    /// That of the replay.
    pub replayed: u64,
}

/// How a step begins.
struct Beginning {
    /// s
    dt: f32,
    /// The units of work that it may do.
    work: u32,
    /// That of its snapshot, bytes.
    size: usize,
    difference: Vec<u8>,
}

/// The file, as far as it was read.
struct FrameReader {
    file: BufReader<File>,
    name: String,
    /// Bytes that are left.
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

    /// The next bytes; `None`: the file ends before.
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

    /// The kind of the next frame, which must be this one; `None`: the file ends.
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

    /// How the next step begins.
    fn begin(&mut self) -> Result<Option<Beginning>> {
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
        Ok(self.fill(&mut bytes)?.map(|()| Beginning {
            dt: f32::from_le_bytes(dt),
            work: u32::from_le_bytes(work),
            size,
            difference: bytes,
        }))
    }

    /// How a step ended: whether it was refused, and the hash.
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
    /// Replays a recording with so many threads, as in [`WorldDefinition`](crate::WorldDefinition), and compares the state after each step
    /// with what was recorded, until the first difference. A step whose end was not recorded is taken too.
    ///
    /// It is bitwise reproducible with the version of the library and the kernel that were recorded.
    ///
    /// # Errors
    /// [`Error::Io`]: the file cannot be read. [`Error::InvalidArgument`]: it is no recording or damaged, or there are too many threads.
    /// [`Error::Unsupported`]: it is of another version of the library, or this processor does not offer its kernel. [`Error::OutOfMemory`].
    pub fn replay(path: &Path, thread_count: u32) -> Result<ReplayReport> {
        let mut frames = FrameReader::open(path)?;
        let mut report = ReplayReport::default();
        let mut world: Option<World> = None;
        let mut before = Vec::new();
        while frames.frame(BEGIN)?.is_some() {
            let Some(begun) = frames.begin()? else {
                report.is_cut_short = true;
                break;
            };
            let mut bytes = applied(&before, &begun.difference, begun.size)?;
            // Lists of a world that was loaded may have other room than those that were recorded. What is in the first snapshot is checked as it is.
            if !before.is_empty() {
                seal(&mut bytes);
            }
            // Where nothing was called between two steps the world goes on.
            let mut it = match world.take() {
                Some(it) if bytes == before => it,
                _ => World::load(&bytes, thread_count, None)?,
            };
            let result = it.step_of(begun.dt, begun.work);
            let Some((is_refused, recorded)) = frames.end()? else {
                report.is_cut_short = true;
                break;
            };
            let replayed = it.state_hash();
            if replayed != recorded || result.is_err() != is_refused {
                report.difference = Some(ReplayDifference {
                    step: report.steps + 1,
                    recorded,
                    replayed,
                });
                break;
            }
            report.steps += 1;
            it.save_again(&mut before)?;
            world = Some(it);
        }
        Ok(report)
    }
}
