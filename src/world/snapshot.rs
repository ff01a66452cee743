//! A world to bytes and back.

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

/// Of everything that is written.
const SHAPE: u64 = {
    let shape = shape_with(WorldDefinition::SHAPE, Body::SHAPE);
    let shape = shape_with(shape, Tool::SHAPE);
    let shape = shape_with(shape, Attachment::SHAPE);
    let shape = shape_with(shape, Blade::SHAPE);
    let shape = shape_with(shape, DeformableContact::SHAPE);
    shape_with(shape, TILE as u64)
};

impl World {
    /// The world as bytes, of which [`World::load`] makes one that goes on just as this one does, to the bit: with bodies as they were cut and torn,
    /// contacts, what is held and sewn, blades in mid stroke, what was applied for the next step, and ids, which name the same things there.
    ///
    /// What is not of the world is not in it: threads, [`BodyReader`](crate::BodyReader)s and [`Embedding`](crate::Embedding)s, which are made again.
    /// The bytes are for this version of the library alone, and are the same for any number of threads. Two worlds that were made alike differ
    /// in the tag of their ids, by which another world refuses them: their states are compared by [`World::state_hash`].
    ///
    /// # Errors
    /// [`Error::Unsupported`]: a [`HapticHandle`](crate::HapticHandle) leads a tool, or more room is kept for what may come than bytes can ask for.
    /// [`Error::OutOfMemory`].
    pub fn save(&self) -> Result<Vec<u8>> {
        let size = self.snapshot_size()?;
        let mut bytes = memory::filled(0, size)?;
        self.save_into(&mut bytes)?;
        Ok(bytes)
    }

    /// How many bytes [`World::save_into`] writes.
    ///
    /// # Errors
    /// [`Error::Unsupported`], as [`World::save`].
    pub fn snapshot_size(&self) -> Result<usize> {
        if let Some(tool) = self.led_by_hand() {
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

    /// The same as [`World::save`] into `bytes`, which are as many as [`World::snapshot_size`] tells.
    ///
    /// # Errors
    /// [`Error::Unsupported`], as [`World::save`], and [`Error::InvalidArgument`]: there are more or fewer bytes. Then nothing is written.
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

    /// The same in place of what is in `bytes`, also while a haptic handle leads a tool, as far as that was led.
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
            tissue,
            walks,
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
            walks.len().save(to);
            slipped.save(to);
            holds_made.save(to);
            clock.save(to);
            lag.save(to);
        });
        write_section(to, *b"BODY", |to| bodies.save(to));
        write_section(to, *b"TOOL", |to| tools.save(to));
        write_section(to, *b"ATTA", |to| attachments.save(to));
        write_section(to, *b"BLAD", |to| blades.save(to));
        write_section(to, *b"TISS", |to| tissue.save(to));
    }

    /// A world of the bytes that [`World::save`] made, with so many threads, or the caller's job system, as in [`WorldDefinition`].
    /// Ids of the world that was saved are its own: the two do not refuse each other's.
    ///
    /// It goes on to the bit where this processor offers the kernel that the world was stepped with; else [`Kernel::Best`] is the best of
    /// this one. What was cut short, has changed or never was a world is refused as a whole.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: the bytes are no world, or there are too many threads. [`Error::Unsupported`]: they are of another version of the
    /// library, or this processor does not offer the kernel that the world was created with, or the system not so many threads.
    /// [`Error::OutOfMemory`].
    pub fn load(bytes: &[u8], thread_count: u32, tasks: Option<RunTasks>) -> Result<Self> {
        let portable = Kernel::Portable.choose()?;
        let mut bytes = opened(bytes, SHAPE)?;
        let (mut world, walk_count) = read_section(&mut bytes, *b"WRLD", portable, |from| {
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
            let walk_count = usize::load(from)?;
            world.slipped = Saved::load(from)?;
            world.holds_made = Saved::load(from)?;
            world.clock = Saved::load(from)?;
            world.lag = Saved::load(from)?;
            if !(world.lag >= 0.0 && world.lag.is_finite()) {
                return Err(from.refusal("a lag that is none"));
            }
            Ok((world, walk_count))
        })?;
        let (kernel, tag) = (world.kernel, world.tag);
        world.bodies = read_section(&mut bytes, *b"BODY", kernel, |from| Slots::load("body", tag, from))?;
        world.tools = read_section(&mut bytes, *b"TOOL", kernel, |from| Slots::load("tool", tag, from))?;
        world.attachments = read_section(&mut bytes, *b"ATTA", kernel, |from| {
            Slots::load("attachment", tag, from)
        })?;
        world.blades = read_section(&mut bytes, *b"BLAD", kernel, |from| Slots::load("blade", tag, from))?;
        world.tissue = read_section(&mut bytes, *b"TISS", kernel, Saved::load)?;
        ensure!(
            bytes.is_empty(),
            "bytes are no world: something is behind its last section"
        );
        ensure!(
            walk_count <= world.bodies.places(),
            "bytes are no world: bodies that are not there go together"
        );
        world.walks = memory::filled(None, walk_count)?;
        world.outcomes = memory::reserved(world.bodies.places() + 1)?;
        world.paths = memory::reserved(world.tools.places() + 1)?;
        world.reserve_dynamic(world.dynamic_count())?;
        Ok(world)
    }
}
