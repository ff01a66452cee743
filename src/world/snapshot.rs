//! Snapshots: a world as bytes, and back.

use super::{World, WorldDefinition};
use crate::base::{Error, Result, WorldTag, ensure, memory};
use crate::body::Body;
use crate::codec::{Saved, Writer, begin, opened, read_section, saved, seal, shape_with, write_section};
use crate::contact::Tool;
use crate::deformable_contact::DeformableContact;
use crate::simd::Kernel;
use crate::slots::Slots;
use crate::soa::TILE;
use crate::threads::RunTasks;

use super::attachments::Attachment;
use super::blade::Blade;

saved! { WorldDefinition {
    gravity, substeps, max_substeps, tolerance, kernel } leaves { thread_count: 1, tasks: None,
} }

/// The hash of the layout of all saved types.
const SHAPE: u64 = {
    let shape = shape_with(WorldDefinition::SHAPE, Body::SHAPE);
    let shape = shape_with(shape, Tool::SHAPE);
    let shape = shape_with(shape, Attachment::SHAPE);
    let shape = shape_with(shape, Blade::SHAPE);
    let shape = shape_with(shape, DeformableContact::SHAPE);
    shape_with(shape, TILE as u64)
};

impl World {
    /// The world as bytes. [`World::load`] restores a world that continues bitwise identically: with cuts and tears,
    /// contacts, attachments, sutures, blades within a stroke, and forces applied for the next step. Ids are valid in
    /// the restored world.
    ///
    /// A snapshot does not contain threads, [`BodyReader`](crate::BodyReader)s and [`Embedding`](crate::Embedding)s;
    /// create them again. The bytes can be loaded by this version of the library only. They do not depend on the number
    /// of threads. The snapshots of two worlds created alike differ in the tag of their ids; compare states by
    /// [`World::state_hash`].
    ///
    /// # Errors
    /// [`Error::Unsupported`]: a [`HapticHandle`](crate::HapticHandle) moves a tool, or the world has reserved more
    /// memory than a snapshot can describe. [`Error::OutOfMemory`].
    pub fn save(&self) -> Result<Vec<u8>> {
        let size = self.snapshot_size()?;
        let mut bytes = memory::filled(0, size)?;
        self.save_into(&mut bytes)?;
        Ok(bytes)
    }

    /// The number of bytes that [`World::save_into`] writes.
    ///
    /// # Errors
    /// [`Error::Unsupported`], as for [`World::save`].
    pub fn snapshot_size(&self) -> Result<usize> {
        if let Some(tool) = self.haptic_tool() {
            return Err(Error::Unsupported(format!(
                "a haptic handle leads tool {}: its thread cannot be saved, destroy the handle first",
                tool.0
            )));
        }
        let mut count = Writer::new(None);
        self.write(&mut count);
        ensure!(
            !count.is_too_large(),
            Error::Unsupported(format!(
                "a world of {} bytes keeps more room for what may come than bytes can ask for",
                count.size()
            ))
        );
        Ok(count.size())
    }

    /// Saves the world as [`World::save`] does, into `bytes` of length [`World::snapshot_size`].
    ///
    /// # Errors
    /// [`Error::Unsupported`], as for [`World::save`]. [`Error::InvalidArgument`]: the length of `bytes` differs. After
    /// an error nothing is written.
    pub fn save_into(&self, bytes: &mut [u8]) -> Result<()> {
        let size = self.snapshot_size()?;
        ensure!(
            bytes.len() == size,
            "size is {}: the world takes {size} bytes",
            bytes.len()
        );
        self.write(&mut Writer::new(Some(bytes)));
        seal(bytes);
        Ok(())
    }

    /// Replaces the contents of `bytes` by a snapshot, also while a haptic handle moves a tool.
    pub(super) fn save_again(&self, bytes: &mut Vec<u8>) -> Result<()> {
        let mut count = Writer::new(None);
        self.write(&mut count);
        ensure!(
            !count.is_too_large(),
            Error::Unsupported("the world keeps more room than bytes can ask for".into())
        );
        bytes.clear();
        memory::reserve(bytes, count.size())?;
        bytes.resize(count.size(), 0);
        self.write(&mut Writer::new(Some(bytes)));
        seal(bytes);
        Ok(())
    }

    fn write(&self, to: &mut Writer) {
        let Self {
            definition,
            tag,
            kernel,
            threads: _,
            bodies,
            tools,
            paths: _,
            dynamic: _,
            deformable_contact,
            coupled,
            outcomes: _,
            attachments,
            slipped,
            blades,
            holds_made,
            haptics: _,
            clock,
            work: _,
            lag,
            pace: _,
            user_data: _,
            profile: _,
            recorder: _,
        } = self;
        begin(to, SHAPE);
        write_section(to, *b"WRLD", |to| {
            definition.save(to);
            tag.generation().save(to);
            kernel.kernel().save(to);
            coupled.len().save(to);
            slipped.save(to);
            holds_made.save(to);
            clock.save(to);
            lag.save(to);
        });
        write_section(to, *b"BODY", |to| bodies.save(to));
        write_section(to, *b"TOOL", |to| tools.save(to));
        write_section(to, *b"ATTA", |to| attachments.save(to));
        write_section(to, *b"BLAD", |to| blades.save(to));
        write_section(to, *b"TISS", |to| deformable_contact.save(to));
    }

    /// Restores a world from a snapshot, with this number of threads or the caller's job system, as in
    /// [`WorldDefinition`]. Ids of the saved world are valid in it.
    ///
    /// It continues bitwise identically if this processor supports the SIMD level of the saved world. Otherwise
    /// [`Kernel::Best`] becomes the best level of this processor. Bytes that are truncated, changed or not a snapshot
    /// are refused.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the bytes are not a snapshot, or `thread_count` is too large.
    /// [`Error::Unsupported`]: the snapshot is of another version of the library, this processor does not support the
    /// SIMD level that the world was created with, or the system cannot start so many threads. [`Error::OutOfMemory`].
    pub fn load(bytes: &[u8], thread_count: u32, tasks: Option<RunTasks>) -> Result<Self> {
        let portable = Kernel::Portable.choose()?;
        let mut bytes = opened(bytes, SHAPE)?;
        let (mut world, coupled_body_count) = read_section(&mut bytes, *b"WRLD", portable, |from| {
            let definition = WorldDefinition {
                thread_count,
                tasks,
                ..Saved::load(from)?
            };
            let tag = WorldTag::of(Saved::load(from)?).ok_or_else(|| from.refusal("ids of no world"))?;
            let kernel = match Kernel::load(from)?.choose() {
                Err(_) if definition.kernel == Kernel::Best => Kernel::Best.choose(),
                chosen => chosen,
            }?;
            let of_this_kernel = WorldDefinition {
                kernel: kernel.kernel(),
                ..definition
            };
            let mut world = Self::with_tag(of_this_kernel, tag)?;
            world.definition.kernel = definition.kernel;
            let coupled_body_count = usize::load(from)?;
            world.slipped = Saved::load(from)?;
            world.holds_made = Saved::load(from)?;
            world.clock = Saved::load(from)?;
            world.lag = Saved::load(from)?;
            if !(world.lag >= 0.0 && world.lag.is_finite()) {
                return Err(from.refusal("a lag that is none"));
            }
            Ok((world, coupled_body_count))
        })?;
        let (kernel, tag) = (world.kernel, world.tag);
        world.bodies = read_section(&mut bytes, *b"BODY", kernel, |from| Slots::load("body", tag, from))?;
        world.tools = read_section(&mut bytes, *b"TOOL", kernel, |from| Slots::load("tool", tag, from))?;
        world.attachments = read_section(&mut bytes, *b"ATTA", kernel, |from| {
            Slots::load("attachment", tag, from)
        })?;
        world.blades = read_section(&mut bytes, *b"BLAD", kernel, |from| Slots::load("blade", tag, from))?;
        world.deformable_contact = read_section(&mut bytes, *b"TISS", kernel, Saved::load)?;
        ensure!(
            bytes.is_empty(),
            "bytes are no world: something is behind its last section"
        );
        ensure!(
            coupled_body_count <= world.bodies.slot_count(),
            "bytes are no world: bodies that are not there go together"
        );
        world.coupled = memory::filled(None, coupled_body_count)?;
        world.outcomes = memory::reserved(world.bodies.slot_count() + 1)?;
        world.paths = memory::reserved(world.tools.slot_count() + 1)?;
        world.reserve_dynamic(world.dynamic_count())?;
        Ok(world)
    }
}
