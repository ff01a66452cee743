//! The thread of a suture. It pulls its two points together along a line if they are further apart than its length.
//!
//! The tension is that at the end of a substep (implicit Euler on a compliant constraint: Macklin, Müller, Chentanez
//! 2016). It is stable for any stiffness, and an inextensible thread has compliance 0. The tension acts along the line
//! between the points at the start of the substep, like a kick of leapfrog, which conserves angular momentum. Points
//! that pass each other within a substep have no such line. They are pulled along the line between their unconstrained
//! end positions.
//!
//! A thread can end at a moving blade instead of a second point ([`LinearPath`]), with a maximum force equal to the
//! cutting resistance.

use glam::DVec3;

use super::CLOSING_SPEED;
use crate::codec::saved;
use crate::solver::SubstepSpan;

/// Maximum relative motion of the points in a substep, as a fraction of their distance, for which the line at the start
/// is used.
const MAX_RELATIVE_MOTION: f64 = 0.5;

/// Minimum compliance of a thread whose points contacts push apart, as a fraction of the compliance of the points in a
/// substep. The thread is then about as stiff as the tissue. Otherwise contact and tension would both grow without
/// limit.
const MIN_SOFTENING: f64 = 0.2;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SutureThread {
    /// Current and final rest length, m.
    pub rest_length: f64,
    pub target_length: f64,
    /// Compliance, m/N; 0 for an inextensible thread.
    pub compliance: f64,
    /// Maximum force, N.
    pub max_force: f64,
    /// Path that replaces the second point.
    pub end_path: Option<LinearPath>,
    // State of the step in progress.
    /// Rate of change of the rest length, m/s, and the rest length now, m.
    length_rate: f64,
    current_length: f64,
    /// Rest length at the end of the substep, m, and the smallest distance that gentle closing reaches, m.
    max_distance: f64,
    gentle_distance: f64,
    /// Position and velocity of the end that follows the path, m and m/s.
    end_position: DVec3,
    end_velocity: DVec3,
    /// Vector from the second point to the first, m.
    offset: DVec3,
    /// Direction of the force. `None` uses the direction between the unconstrained end positions.
    direction: Option<DVec3>,
    /// Durations for which velocities act on positions and forces on velocities in the substep, s.
    drift_duration: f64,
    force_duration: f64,
    /// Elongation per impulse, m/(N s), and change of relative velocity per impulse, 1/kg.
    impulse_compliance: f64,
    inverse_mass: DVec3,
    // State of the last step.
    /// Elongation per force, m/N.
    effective_compliance: f64,
}

saved! { SutureThread {
    rest_length, target_length, compliance, max_force, end_path, length_rate, current_length, max_distance,
    gentle_distance, end_position, end_velocity, offset, direction, drift_duration, force_duration,
    impulse_compliance, inverse_mass, effective_compliance,
} }

/// Positions at the start and end of the next step, with uniform motion between them, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinearPath {
    pub from: DVec3,
    pub to: DVec3,
}

saved! { LinearPath { from, to } }

impl LinearPath {
    /// Returns the path moved by an offset.
    pub fn moved(self, offset: DVec3) -> Self {
        Self {
            from: self.from + offset,
            to: self.to + offset,
        }
    }

    /// Returns the path multiplied by the sum of a point's weights, to be subtracted from that point.
    pub fn scaled(self, weight: f64) -> Self {
        Self {
            from: self.from * weight,
            to: self.to * weight,
        }
    }
}

impl SutureThread {
    /// Creates a thread of zero length from a point to a path.
    pub fn to_path(end_path: LinearPath, compliance: f64, max_force: f64) -> Self {
        Self {
            end_path: Some(end_path),
            max_force,
            ..Self::new(0.0, 0.0, compliance)
        }
    }

    pub fn new(rest_length: f64, target_length: f64, compliance: f64) -> Self {
        Self {
            rest_length,
            target_length,
            compliance,
            max_force: f64::INFINITY,
            current_length: rest_length,
            max_distance: rest_length,
            effective_compliance: compliance,
            ..Self::default()
        }
    }

    /// Returns the rest length after a step of `dt` seconds. It shortens no faster than the closing speed of
    /// attachments.
    pub fn length_after(&self, dt: f32) -> f64 {
        self.target_length.max(self.rest_length - CLOSING_SPEED * f64::from(dt))
    }

    /// Returns the stored energy at this distance of the points, J.
    pub fn energy(&self, distance: f64) -> f64 {
        let stretch = (distance - self.rest_length).max(0.0);
        if self.effective_compliance > 0.0 {
            0.5 * stretch * stretch / self.effective_compliance
        } else {
            0.0
        }
    }

    /// True if the thread only stretched elastically in the step in progress.
    pub fn is_elastic(&self) -> bool {
        let max_compliance = self
            .effective_compliance
            .max(self.impulse_compliance * self.force_duration);
        self.end_path.is_none()
            && self.target_length == self.rest_length
            && max_compliance <= self.compliance * (1.0 + 1e-6)
    }

    /// Begins a step of `dt` seconds.
    pub fn begin(&mut self, dt: f32) {
        self.length_rate = (self.length_after(dt) - self.rest_length) / f64::from(dt);
        self.current_length = self.rest_length;
        if let Some(LinearPath { from, to }) = self.end_path {
            self.end_position = from;
            self.end_velocity = (to - from) / f64::from(dt);
        }
    }

    /// Begins a substep with the offset and relative velocity of the points. Forces act for `duration` seconds.
    pub fn begin_substep(
        &mut self,
        offset: DVec3,
        velocity: DVec3,
        inverse_mass: DVec3,
        duration: f32,
        span: &SubstepSpan,
    ) {
        // The closing half kick of a step counts as if half a substep followed.
        let fraction = if span.drifts { 1.0 } else { 0.5 };
        self.drift_duration = fraction * f64::from(span.duration);
        self.force_duration = f64::from(duration);
        self.impulse_compliance = self.compliance / self.force_duration;
        self.inverse_mass = inverse_mass;
        let (offset, velocity) = (offset - self.end_position, velocity - self.end_velocity);
        self.offset = offset;
        let distance = offset.length();
        let is_resolved = velocity.length() * self.drift_duration <= MAX_RELATIVE_MOTION * distance && distance > 0.0;
        self.direction = is_resolved.then(|| offset / distance);
        self.max_distance = (self.current_length + self.length_rate * self.drift_duration).max(0.0);
        // An inextensible thread may start with its points too far apart, which closes gently.
        let is_inextensible = self.compliance == 0.0;
        self.gentle_distance = if is_inextensible {
            self.gentle_distance_from(distance)
        } else {
            0.0
        };
    }

    /// Returns the smallest distance that gentle closing reaches in this substep, m.
    fn gentle_distance_from(&self, distance: f64) -> f64 {
        distance - CLOSING_SPEED * self.drift_duration
    }

    /// Softens the thread, and closes it gently, because contacts push its points apart.
    pub fn soften(&mut self, span: &SubstepSpan) {
        if self.end_path.is_none() {
            // Makes the compliance per force equal for half and whole kicks.
            let min_compliance = MIN_SOFTENING * self.inverse_mass.max_element() * f64::from(span.duration).powi(2)
                / self.force_duration;
            self.impulse_compliance = self.impulse_compliance.max(min_compliance);
            self.gentle_distance = self.gentle_distance_from(self.offset.length());
        }
    }

    /// Ends a substep.
    pub fn end_substep(&mut self, span: &SubstepSpan) {
        if span.drifts {
            self.current_length = (self.current_length + self.length_rate * self.drift_duration).max(0.0);
            self.end_position += self.end_velocity * self.drift_duration;
        }
    }

    /// Commits the step of `dt` seconds.
    pub fn commit(&mut self, dt: f32) {
        self.rest_length = self.length_after(dt);
        self.effective_compliance = self.impulse_compliance * self.force_duration;
    }

    /// Returns the total impulse on the first point in this substep, N s. `velocity` is the relative velocity after the
    /// impulse `applied`.
    pub fn impulse(&self, velocity: DVec3, applied: DVec3) -> DVec3 {
        let unconstrained_offset =
            self.offset + (velocity - self.end_velocity - self.inverse_mass * applied) * self.drift_duration;
        // Limits the tension by the elongation and by the closing speed.
        let stretched = self.impulse_to_reach(unconstrained_offset, self.max_distance, self.impulse_compliance);
        let magnitude = if self.gentle_distance > self.max_distance {
            stretched.min(self.impulse_to_reach(unconstrained_offset, self.gentle_distance, 0.0))
        } else {
            stretched
        };
        let direction = self
            .direction
            .unwrap_or(unconstrained_offset / unconstrained_offset.length());
        if magnitude > 0.0 && magnitude.is_finite() {
            -direction * magnitude.min(self.max_force * self.force_duration)
        } else {
            DVec3::ZERO
        }
    }

    /// Returns the impulse after which the distance of the points equals `max_distance` plus the elongation, N s; 0 if
    /// they end nearer without it.
    fn impulse_to_reach(&self, unconstrained_offset: DVec3, max_distance: f64, impulse_compliance: f64) -> f64 {
        let distance = unconstrained_offset.length();
        if !(distance > max_distance) {
            return 0.0;
        }
        let direction = self.direction.unwrap_or(unconstrained_offset / distance);
        // Solves |offset - impulse displacement| = max_distance + impulse compliance for the smaller impulse.
        let displacement_per_impulse = self.inverse_mass * direction * self.drift_duration;
        let quadratic = displacement_per_impulse.length_squared() - impulse_compliance * impulse_compliance;
        let linear = unconstrained_offset.dot(displacement_per_impulse) + max_distance * impulse_compliance;
        let excess = (distance - max_distance) * (distance + max_distance);
        match linear * linear - quadratic * excess {
            discriminant if discriminant >= 0.0 => excess / (linear + discriminant.sqrt()),
            // That distance is not reachable along this line, so the impulse minimizes the distance.
            _ => linear / quadratic,
        }
    }
}
