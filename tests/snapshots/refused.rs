//! Invalid bytes are not loaded, and unsupported worlds are not saved.

use std::panic::{AssertUnwindSafe, catch_unwind};

use sinew::{Error, HapticDefinition, Shape, ToolDefinition, World};
use xxhash_rust::xxh3::Xxh3Default;

use super::acts::{Caller, Random};
use super::world;

/// The positions of the version, the size and the checksum in the header, and the end of the header.
const VERSION: usize = 8;
const CHECKSUM: usize = 28;
const HEADER: usize = 36;

/// Returns a world with every kind of object, as bytes.
fn bytes(seed: u64) -> Vec<u8> {
    let mut caller = Caller::new(seed);
    let mut worlds = [world(1)];
    for _ in 0..8 {
        for _ in 0..4 {
            caller.act(&mut worlds);
        }
        caller.step(&mut worlds);
    }
    worlds[0].save().expect("bytes")
}

fn load(bytes: &[u8]) -> Result<World, Error> {
    World::load(bytes, 1, None)
}

/// Updates the checksum, as a forger would.
fn update_checksum(bytes: &mut [u8]) {
    let mut hasher = Xxh3Default::new();
    hasher.update(&bytes[..CHECKSUM]);
    hasher.update(&bytes[HEADER..]);
    bytes[CHECKSUM..HEADER].copy_from_slice(&hasher.digest().to_le_bytes());
}

#[test]
fn truncated_or_changed_bytes_are_refused() {
    truncated_or_changed_bytes_are_refused_of(|at| at < 64 || at.is_multiple_of(9973));
}

#[test]
#[ignore = "long"]
fn truncated_or_changed_bytes_are_refused_in_more_places() {
    truncated_or_changed_bytes_are_refused_of(|at| (64..300).contains(&at) || at > 300 && at.is_multiple_of(997));
}

fn truncated_or_changed_bytes_are_refused_of(is_selected: fn(usize) -> bool) {
    let bytes = bytes(3);
    assert!(load(&bytes).is_ok());
    for size in (0..bytes.len()).filter(|size| is_selected(*size)) {
        let refused = load(&bytes[..size]).expect_err("cut short");
        assert!(matches!(refused, Error::InvalidArgument(_)), "{size}: {refused}");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(load(&longer), Err(Error::InvalidArgument(_))));
    let mut changed = bytes.clone();
    for at in (0..bytes.len()).filter(|at| is_selected(*at)) {
        for bit in [0, 3, 7] {
            changed[at] ^= 1 << bit;
            assert!(load(&changed).is_err(), "bit {bit} of byte {at}");
            changed[at] ^= 1 << bit;
        }
    }
    assert!(changed == bytes && load(&changed).is_ok());
}

#[test]
fn other_files_are_refused_by_kind() {
    let said = |bytes: &[u8]| load(bytes).expect_err("no world").to_string();
    assert!(said(b"").contains("header"));
    assert!(said(b"solid organ\n").contains("begin with something else"));
    assert!(said(&[0x89, b'P', b'N', b'G', 13, 10, 26, 10]).contains("begin with something else"));
    let whole = bytes(3);
    assert!(said(&whole[..whole.len() - 1]).contains("saved as"));
    let mut changed = whole.clone();
    changed[whole.len() / 2] ^= 1;
    assert!(said(&changed).contains("checksum"));
    let mut later_version = whole.clone();
    later_version[VERSION] += 1;
    update_checksum(&mut later_version);
    assert!(matches!(load(&later_version), Err(Error::Unsupported(_))));
    // A version whose fields differ.
    let mut other_fields = whole;
    other_fields[VERSION + 4] ^= 1;
    update_checksum(&mut other_fields);
    assert!(matches!(load(&other_fields), Err(Error::Unsupported(_))));
}

/// Forged bytes cause at worst a panic in a step, and bytes with unchanged values are saved again identically.
#[test]
fn bytes_with_a_valid_checksum_are_still_validated() {
    let whole = bytes(5);
    let mut random = Random(1);
    let mut refused = 0;
    for _ in 0..400 {
        let mut forged = whole.clone();
        for _ in 0..1 + random.below(3) {
            let at = HEADER + random.below(forged.len() - HEADER);
            forged[at] = random.below(256) as u8;
        }
        update_checksum(&mut forged);
        let loaded = catch_unwind(|| load(&forged)).expect("bytes are loaded or refused");
        match loaded {
            Ok(mut world) => {
                let _ = catch_unwind(AssertUnwindSafe(|| world.step(1e-3)));
            }
            Err(_) => refused += 1,
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn unsupported_worlds_report_an_error() {
    let mut world = world(1);
    let size = world.snapshot_size().expect("a size");
    for wrong in [0, size - 1, size + 1] {
        let mut buffer = vec![7; wrong];
        let refused = world.save_into(&mut buffer).expect_err("another size");
        assert!(refused.to_string().contains(&format!("size is {wrong}")), "{refused}");
        assert!(buffer.iter().all(|&byte| byte == 7));
    }
    let tool = world
        .create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))
        .expect("a tool");
    let handle = world.create_haptic(&HapticDefinition::new(tool)).expect("a handle");
    let refused = world.save().expect_err("a thread leads the tool");
    assert!(
        matches!(&refused, Error::Unsupported(why) if why.contains("haptic")),
        "{refused}"
    );
    drop(handle);
    assert!(world.save().is_ok());
}
