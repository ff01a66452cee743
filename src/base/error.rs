//! Errors.
use super::StepReport;

/// Why a call was refused or failed. A call that returns an error has changed nothing.
///
/// ```
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// let refused = world.step(-1.0);
/// assert!(matches!(refused, Err(Error::InvalidArgument(_))));
/// assert_eq!(world.step_count(), 0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// An argument is out of range; the message names it and its value.
    InvalidArgument(String),
    /// The id names a destroyed object, or no object at all.
    StaleId(String),
    /// A storage of fixed capacity is full.
    Capacity(String),
    /// Memory could not be reserved.
    OutOfMemory,
    /// The step was not taken: nothing moved, pending forces and poses stay pending.
    Unstable {
        /// The report of the refused step.
        report: StepReport,
        /// The number of substeps that were allowed.
        allowed: u32,
    },
    /// No solution within the allowed iterations: nothing changed.
    NotConverged(String),
    /// Valid, but not supported by this build or in this combination.
    Unsupported(String),
    /// A file could not be read or written; the message names the file and the line or byte.
    Io(String),
    /// A fault inside the library: the world refuses every further call.
    Internal(String),
}

/// The result of calls that can fail.
///
/// ```
/// use sinew::{Result, mesh::Mesh};
/// fn weight(mesh: &Mesh, density: f64) -> Result<f64> {
///     Ok(9.81 * density * mesh.volume()?)
/// }
/// assert!((weight(&Mesh::block([0.1, 0.1, 0.1], [1, 1, 1])?, 1000.0)? - 9.81).abs() < 1e-4);
/// # Ok::<(), sinew::Error>(())
/// ```
pub type Result<T> = std::result::Result<T, Error>;

/// Returns an error unless the condition holds: an invalid argument with a `format!` message, or the given error.
macro_rules! ensure {
    ($holds:expr, $format:literal $($arguments:tt)*) => {
        $crate::base::ensure!($holds, $crate::base::Error::invalid(format!($format $($arguments)*)))
    };
    ($holds:expr, $error:expr $(,)?) => {
        if !$holds {
            return Err($error);
        }
    };
}
pub(crate) use ensure;

impl Error {
    /// An [`Error::InvalidArgument`] with this message.
    pub(crate) fn invalid(message: impl Into<String>) -> Self {
        Error::InvalidArgument(message.into())
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Error::InvalidArgument(message)
            | Error::StaleId(message)
            | Error::Capacity(message)
            | Error::NotConverged(message)
            | Error::Unsupported(message)
            | Error::Io(message)
            | Error::Internal(message) => f.write_str(message),
            Error::OutOfMemory => f.write_str("out of memory"),
            Error::Unstable { report, allowed } if report.error_estimate > 0.0 => write!(
                f,
                "the step could not be taken in the {allowed} substeps allowed: the tolerance needs more, {} m is off; a larger \
                 tolerance or max_substeps, or shorter steps, help",
                report.error_estimate
            ),
            Error::Unstable { report, allowed } => {
                write!(
                    f,
                    "the step could not be taken in the {allowed} substeps allowed: the longest stable one is {} s",
                    report.stable_substep
                )?;
                report.limit.map_or(Ok(()), |limit| write!(f, "; {limit}"))
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<std::collections::TryReserveError> for Error {
    fn from(_: std::collections::TryReserveError) -> Self {
        Error::OutOfMemory
    }
}
