//! The lock-free hand-overs between threads under loom, which tries every thread interleaving and every visible value.
//! It compiles the library's own files with loom's types instead of the standard library's. Each run with a weakened
//! ordering must fail.
#![allow(clippy::duplicate_mod, reason = "once for each set of orderings")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use loom::thread;

/// Loom's versions of what the library's `sync/atomics.rs` has.
mod atomics {
    use std::sync::atomic::Ordering;

    pub use loom::cell::UnsafeCell;
    pub use loom::sync::atomic::{AtomicU8, AtomicU64, fence};

    pub const ACQUIRE_RELEASE: Ordering = Ordering::AcqRel;
    pub const ANNOUNCE: Ordering = Ordering::Release;
    pub const LISTEN: Ordering = Ordering::Acquire;
    pub const LET_GO: Ordering = Ordering::Release;
    pub const TAKE_BACK: Ordering = Ordering::AcqRel;
    pub const TELL_BEFORE_LOOKING: Ordering = Ordering::SeqCst;
}

/// Declares a module with the library's files and the given orderings changed.
macro_rules! with {
    ($name:ident $(, $ordering:ident = $weak:ident)*) => {
        #[path = "."]
        #[allow(dead_code)]
        mod $name {
            mod atomics {
                #[allow(unused_imports)]
                pub use crate::atomics::*;
                $(pub const $ordering: std::sync::atomic::Ordering = std::sync::atomic::Ordering::$weak;)*
            }
            #[path = "../src/sync/pool.rs"]
            pub mod pool;
            #[path = "../src/sync/triple_buffer.rs"]
            pub mod triple_buffer;
        }
    };
}

with!(right);
with!(release_alone, ACQUIRE_RELEASE = Release);
with!(acquire_alone, ACQUIRE_RELEASE = Acquire);
with!(announced_too_early, ANNOUNCE = Relaxed);
with!(heard_too_late, LISTEN = Relaxed);
with!(let_go_too_early, LET_GO = Relaxed);
with!(taken_back_too_early, TAKE_BACK = Release);
with!(looked_before_told, TELL_BEFORE_LOOKING = AcqRel);

/// Tries all interleavings with up to `changes` preemptions.
fn model(changes: usize, run: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(changes);
    builder.check(run);
}

/// Returns true if loom finds a fault.
fn is_found(model: impl FnOnce()) -> bool {
    catch_unwind(AssertUnwindSafe(model)).is_err()
}

macro_rules! triple_buffer_test {
    ($files:ident) => {
        model(3, || {
            let (mut writer, mut reader) = $files::triple_buffer::triple_buffer([[0; 2]; 3]);
            let writing = thread::spawn(move || {
                for version in 1..=3 {
                    writer.write(|value| *value = [version; 2]);
                }
            });
            let mut before = 0;
            let mut read = |reader: &mut $files::triple_buffer::BufferReader<[u32; 2]>| {
                let is_new = reader.take();
                let [first, second] = reader.read(|value| *value);
                assert_eq!(first, second, "torn");
                assert_eq!(is_new, first > before, "{first} after {before}");
                before = first;
            };
            read(&mut reader);
            read(&mut reader);
            writing.join().expect("a writer");
            read(&mut reader);
            assert_eq!(before, 3);
        })
    };
}

/// A writer, and readers on their own threads.
macro_rules! pool_test {
    ($files:ident, $changes:expr, $readers:expr, $writes:expr, $reads:expr) => {
        model($changes, || {
            let mut writer = $files::pool::PoolWriter::new(2, [[1_u64; 2], [0; 2]]).expect("memory");
            let read = |mut reader: $files::pool::PoolReader<[u64; 2]>| {
                for _ in 0..$reads {
                    let before = reader.version();
                    let is_new = reader.take();
                    assert!(
                        if is_new {
                            reader.version() > before
                        } else {
                            reader.version() == before
                        },
                        "version {} after {before}",
                        reader.version()
                    );
                    assert_eq!(*reader.get(), [reader.version(); 2]);
                }
                reader
            };
            let readers: Vec<_> = (0..$readers)
                .map(|_| {
                    let reader = writer.add_reader(|| Ok::<_, ()>([0; 2]));
                    let reader = reader.expect("a buffer").expect("a place");
                    thread::spawn(move || read(reader))
                })
                .collect();
            for version in 2..$writes + 2 {
                assert!(writer.write(|value| *value = [version; 2]), "no buffer is free");
            }
            drop(writer);
            for reader in readers {
                let mut reader = reader.join().expect("a reader");
                reader.take();
                assert_eq!(*reader.get(), [$writes + 1; 2], "the last");
                assert!(reader.is_over());
            }
        })
    };
}

#[test]
fn a_triple_buffer_delivers_complete_values_in_order_up_to_the_last() {
    triple_buffer_test!(right);
}

#[test]
#[cfg_attr(windows, ignore = "SKIPPED: what panics on loom's threads ends the process there")]
fn a_triple_buffer_needs_its_ordering() {
    assert!(is_found(|| triple_buffer_test!(release_alone)));
    assert!(is_found(|| triple_buffer_test!(acquire_alone)));
}

#[test]
fn a_pool_delivers_complete_values_in_order_up_to_the_last() {
    pool_test!(right, 3, 1, 4, 3);
}

#[test]
fn a_pool_serves_two_readers() {
    pool_test!(right, 2, 2, 3, 2);
}

#[test]
#[cfg_attr(windows, ignore = "SKIPPED: what panics on loom's threads ends the process there")]
fn a_pool_needs_each_of_its_orderings() {
    assert!(is_found(|| pool_test!(announced_too_early, 3, 1, 4, 3)), "announce");
    assert!(is_found(|| pool_test!(heard_too_late, 3, 1, 4, 3)), "listen");
    assert!(is_found(|| pool_test!(let_go_too_early, 3, 1, 4, 3)), "let go");
    assert!(is_found(|| pool_test!(taken_back_too_early, 3, 1, 4, 3)), "take back");
    assert!(
        is_found(|| pool_test!(looked_before_told, 3, 1, 4, 3)),
        "tell before looking"
    );
}

/// One reader is dropped while another is added and reuses its buffer.
#[test]
fn readers_can_be_added_and_dropped() {
    static SHARED: AtomicBool = AtomicBool::new(false);
    model(3, || {
        let mut writer = right::pool::PoolWriter::new(1, [[1_u64; 2], [0; 2]]).expect("memory");
        let add =
            |writer: &mut right::pool::PoolWriter<_>| writer.add_reader(|| Ok::<_, ()>([0; 2])).expect("a buffer");
        let mut first = add(&mut writer).expect("a place");
        let going = thread::spawn(move || {
            first.take();
            assert_eq!(*first.get(), [first.version(); 2]);
        });
        assert!(writer.write(|value| *value = [2; 2]));
        if let Some(mut second) = add(&mut writer) {
            SHARED.store(true, Ordering::Relaxed);
            assert_eq!(*second.get(), [2; 2]);
            for version in 3..=4 {
                assert!(writer.write(|value| *value = [version; 2]), "no buffer is free");
            }
            assert_eq!(*second.get(), [2; 2]);
            assert!(second.take() && !second.take());
            assert_eq!(*second.get(), [4; 2]);
        }
        going.join().expect("a reader");
    });
    assert!(SHARED.load(Ordering::Relaxed), "one went before another came");
}

/// Both sides can be dropped in any order on any thread. Their shared data is freed once, with the last side.
#[test]
fn shared_data_is_freed_once() {
    model(3, || {
        let value = Arc::new(());
        let [a, b, c] = [&value; 3].map(Arc::clone);
        let mut writer = right::pool::PoolWriter::new(1, [a, b]).expect("memory");
        let reader = writer
            .add_reader(|| Ok::<_, ()>(c))
            .expect("a buffer")
            .expect("a place");
        let ending = thread::spawn(move || drop(reader));
        writer.write(|_| ());
        drop(writer);
        ending.join().expect("a reader");
        assert_eq!(Arc::strong_count(&value), 1);
    });
}
