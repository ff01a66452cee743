//! `benches/fast_link.c`: compiled here by the system's C compiler for this very processor, and opened.
#![allow(unsafe_code)]

#[cfg(unix)]
pub use offered::{FastLink, Library};
#[cfg(not(unix))]
pub use refused::{FastLink, Library};

/// How the C program works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// Forces and integration in one pass over the nodes, or in two.
    pub passes: u32,
    /// The nodes from here whose neighbours are prefetched; 0: no prefetch.
    pub ahead: u32,
}

impl Way {
    /// As the paper has it, straight on.
    pub const PLAIN: Self = Self { passes: 2, ahead: 0 };

    /// The ways with prefetch, of which the fastest counts.
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

    use super::Way;
    use crate::scenes::{GRAVITY, MASS, STIFFNESS, SUBSTEP, Scene};

    type Create =
        unsafe extern "C" fn(u32, u32, *const f32, *const f32, usize, *const u32, *const f32, f32) -> *mut c_void;
    type Step = unsafe extern "C" fn(*mut c_void, f32, f32, u32, u32);
    type Positions = unsafe extern "C" fn(*const c_void) -> *const f32;
    type Destroy = unsafe extern "C" fn(*mut c_void);

    /// The C program, open until this program ends.
    pub struct Library {
        create: Create,
        step: Step,
        positions: Positions,
        destroy: Destroy,
    }

    impl Library {
        /// Or why there is none.
        pub fn compile() -> Result<Self, String> {
            let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/fast_link.c");
            let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
            let library: PathBuf = folder.join(format!("fast_link_{}.so", std::process::id()));
            // Strict C11 would have gcc leave out fused multiply-add.
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
            // Once open, it needs no file.
            let _ = std::fs::remove_file(&library);
            opened
        }

        fn open(path: &Path) -> Result<Self, String> {
            let name = CString::new(path.as_os_str().as_bytes()).map_err(|error| error.to_string())?;
            // SAFETY: a string that ends; the library was compiled from our own source and runs nothing on opening.
            let handle = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
            if handle.is_null() {
                return Err(format!("{} cannot be opened", path.display()));
            }
            let symbol = |name: &std::ffi::CStr| {
                // SAFETY: an open library and a string that ends.
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
            // SAFETY: arrays of the lengths given: 3 floats a position, 2 indices below the node count a spring; they are
            // used during the call alone.
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

        pub fn step(&mut self, way: Way, steps: usize) {
            for _ in 0..steps {
                // SAFETY: a body that was made by this library and not destroyed.
                unsafe { (self.library.step)(self.body, SUBSTEP, GRAVITY, way.ahead, way.passes) };
            }
        }

        pub fn positions(&self) -> &[Vec3] {
            // SAFETY: the body keeps that many positions of three floats, and no step runs while this is borrowed.
            unsafe { std::slice::from_raw_parts((self.library.positions)(self.body).cast(), self.node_count) }
        }
    }

    impl Drop for FastLink<'_> {
        fn drop(&mut self) {
            // SAFETY: made by this library, destroyed once.
            unsafe { (self.library.destroy)(self.body) };
        }
    }
}

#[cfg(not(unix))]
mod refused {
    use std::marker::PhantomData;

    use glam::Vec3;

    use super::Way;
    use crate::scenes::Scene;

    /// There is none here.
    pub enum Library {}

    impl Library {
        pub fn compile() -> Result<Self, String> {
            Err("is opened with dlopen, on Unix alone".into())
        }
    }

    /// There is none here.
    pub struct FastLink<'a> {
        library: Library,
        borrowed: PhantomData<&'a ()>,
    }

    impl<'a> FastLink<'a> {
        pub fn new(library: &'a Library, _: &Scene) -> Self {
            match *library {}
        }

        pub fn step(&mut self, _: Way, _: usize) {
            match self.library {}
        }

        pub fn positions(&self) -> &[Vec3] {
            match self.library {}
        }
    }
}
