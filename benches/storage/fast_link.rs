//! Compiles `benches/fast_link.c` with the system's C compiler for this processor, and loads it.
#![allow(unsafe_code)]

#[cfg(unix)]
pub use offered::{FastLink, Library};
#[cfg(not(unix))]
pub use refused::{FastLink, Library};

/// A variant of the C program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// One pass over the nodes for forces and integration, or two.
    pub passes: u32,
    /// Prefetch distance in nodes; 0: no prefetch.
    pub ahead: u32,
}

impl Variant {
    /// The plain variant of the paper.
    pub const PLAIN: Self = Self { passes: 2, ahead: 0 };

    /// The variants with prefetch, of which the fastest counts.
    pub fn prefetching() -> impl Iterator<Item = Self> {
        [1, 2]
            .into_iter()
            .flat_map(|passes| [8, 16, 24, 32].map(|ahead| Self { passes, ahead }))
    }
}

#[cfg(unix)]
mod offered {
    use std::ffi::{CString, c_void};
    use std::os::unix::ffi::OsStrExt;
    use std::path::{Path, PathBuf};
    use std::process::Command;

    use glam::Vec3;

    use super::Variant;
    use crate::scenes::{GRAVITY, MASS, STIFFNESS, SUBSTEP, Scene};

    type Create =
        unsafe extern "C" fn(u32, u32, *const f32, *const f32, usize, *const u32, *const f32, f32) -> *mut c_void;
    type Step = unsafe extern "C" fn(*mut c_void, f32, f32, u32, u32);
    type Positions = unsafe extern "C" fn(*const c_void) -> *const f32;
    type Destroy = unsafe extern "C" fn(*mut c_void);

    /// The C program, loaded until this program ends.
    pub struct Library {
        create: Create,
        step: Step,
        positions: Positions,
        destroy: Destroy,
    }

    impl Library {
        /// Compiles and loads the C program, or returns the reason of a failure.
        pub fn compile() -> Result<Self, String> {
            let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/fast_link.c");
            let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
            let library: PathBuf = folder.join(format!("fast_link_{}.so", std::process::id()));
            // With strict C11, gcc would not use fused multiply-add.
            let output = Command::new("cc")
                .args([
                    "-std=gnu11",
                    "-O3",
                    "-march=native",
                    "-fno-math-errno",
                    "-shared",
                    "-fPIC",
                    "-o",
                ])
                .arg(&library)
                .arg(&source)
                .arg("-lm")
                .output()
                .map_err(|error| format!("cc: {error}"))?;
            if !output.status.success() {
                return Err(format!("cc: {}", String::from_utf8_lossy(&output.stderr)));
            }
            let opened = Self::open(&library);
            // The file is not needed after loading.
            let _ = std::fs::remove_file(&library);
            opened
        }

        fn open(path: &Path) -> Result<Self, String> {
            let name = CString::new(path.as_os_str().as_bytes()).map_err(|error| error.to_string())?;
            // SAFETY: a terminated string; the library was compiled from our own source and has no load-time code.
            let handle = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
            if handle.is_null() {
                return Err(format!("{} cannot be opened", path.display()));
            }
            let symbol = |name: &std::ffi::CStr| {
                // SAFETY: a loaded library and a terminated string.
                let symbol = unsafe { libc::dlsym(handle, name.as_ptr()) };
                if symbol.is_null() {
                    Err(format!("{name:?} is missing"))
                } else {
                    Ok(symbol)
                }
            };
            // SAFETY: functions of these types in fast_link.c, in a library that is never closed.
            unsafe {
                Ok(Self {
                    create: std::mem::transmute::<*mut c_void, Create>(symbol(c"fast_link_create")?),
                    step: std::mem::transmute::<*mut c_void, Step>(symbol(c"fast_link_step")?),
                    positions: std::mem::transmute::<*mut c_void, Positions>(symbol(c"fast_link_positions")?),
                    destroy: std::mem::transmute::<*mut c_void, Destroy>(symbol(c"fast_link_destroy")?),
                })
            }
        }
    }

    /// A body of the C program.
    pub struct FastLink<'a> {
        library: &'a Library,
        body: *mut c_void,
        node_count: usize,
    }

    impl<'a> FastLink<'a> {
        pub fn new(library: &'a Library, scene: &Scene) -> Self {
            let node_count = scene.positions.len();
            let mut degrees = vec![0u32; node_count];
            for &node in scene.springs.iter().flatten() {
                degrees[node as usize] += 1;
            }
            let springs_per_node = degrees.into_iter().max().unwrap_or(0);
            let mut inverse_masses = vec![1.0 / MASS; node_count];
            for &node in &scene.pinned {
                inverse_masses[node as usize] = 0.0;
            }
            let rest_lengths: Vec<f32> = scene.springs.iter().map(|&pair| scene.rest_length(pair)).collect();
            // SAFETY: arrays of the stated lengths, with 3 floats per position and 2 indices below the node count per
            // spring. They are used only during the call.
            let body = unsafe {
                (library.create)(
                    node_count as u32,
                    springs_per_node,
                    scene.positions.as_ptr().cast(),
                    inverse_masses.as_ptr(),
                    scene.springs.len(),
                    scene.springs.as_ptr().cast(),
                    rest_lengths.as_ptr(),
                    STIFFNESS,
                )
            };
            assert!(!body.is_null(), "memory for the C program");
            Self {
                library,
                body,
                node_count,
            }
        }

        pub fn step(&mut self, variant: Variant, steps: usize) {
            for _ in 0..steps {
                // SAFETY: a body that was created by this library and not destroyed.
                unsafe { (self.library.step)(self.body, SUBSTEP, GRAVITY, variant.ahead, variant.passes) };
            }
        }

        pub fn positions(&self) -> &[Vec3] {
            // SAFETY: the body has this many positions of three floats, and no step runs while the slice is borrowed.
            unsafe { std::slice::from_raw_parts((self.library.positions)(self.body).cast(), self.node_count) }
        }
    }

    impl Drop for FastLink<'_> {
        fn drop(&mut self) {
            // SAFETY: created by this library, destroyed once.
            unsafe { (self.library.destroy)(self.body) };
        }
    }
}

#[cfg(not(unix))]
mod refused {
    use std::marker::PhantomData;

    use glam::Vec3;

    use super::Variant;
    use crate::scenes::Scene;

    /// Not available on this platform.
    pub enum Library {}

    impl Library {
        pub fn compile() -> Result<Self, String> {
            Err("is opened with dlopen, on Unix alone".into())
        }
    }

    /// Not available on this platform.
    pub struct FastLink<'a> {
        library: Library,
        borrowed: PhantomData<&'a ()>,
    }

    impl<'a> FastLink<'a> {
        pub fn new(library: &'a Library, _: &Scene) -> Self {
            match *library {}
        }

        pub fn step(&mut self, _: Variant, _: usize) {
            match self.library {}
        }

        pub fn positions(&self) -> &[Vec3] {
            match self.library {}
        }
    }
}
