//! The thread of a suture: it pulls its two points along the line between them where they are further apart than it is long.
//!
//! Its tension is that at the end of a substep (implicit Euler on a compliant constraint: Macklin, Müller, Chentanez 2016), so that no stiffness is too
//! much for any substep, and what does not stretch is a compliance of 0. It acts along the line on which the points are as the substep begins,
//! as a kick of leapfrog does, which keeps angular momentum; points that pass each other within a substep have no such line, and are pulled
//! along the one on which they would end.
//!
//! A thread may have a blade at its end instead of a second point (`Lead`), and pull no harder than the tissue that is cut resists.

use glam::DVec3;

use super::CLOSING_SPEED;
use crate::codec::saved;
use crate::solver::Span;

/// Points that move against each other by no more than this part of their distance in a substep keep to their line.
const RESOLVED: f64 = 0.5;

/// Where contacts keep its points apart, a thread gives way by this part of what the points give way to it in a substep, at least: then it is about as
/// stiff as the tissue there. What is to be nearer than contacts let it could not be had, and what pulls and presses would grow without end.
const LEAST_GIVE: f64 = 0.2;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Thread {
    /// How long it is while nothing pulls, and what it is to become, m.
    pub length: f64,
    pub target: f64,
    /// m/N; 0: it does not stretch.
    pub compliance: f64,
    /// It pulls no harder, N.
    pub most: f64,
    /// What it ends at instead of a point of tissue.
    pub lead: Option<Lead>,
    // The step in progress.
    /// How fast it becomes longer, m/s, and how long it is by now, m.
    pace: f64,
    current: f64,
    /// How far apart its points may be at the end of the substep, m, and how near they come at most where it draws them together gently.
    reach: f64,
    gentle: f64,
    /// Where the lead is by now, m, and how fast, m/s.
    led: DVec3,
    speed: DVec3,
    /// From the second point to the first, m.
    apart: DVec3,
    /// The direction in which it acts; where there is none, that of the points as they would end.
    line: Option<DVec3>,
    /// How long velocities act on places in the substep, s, and forces on velocities.
    drift: f64,
    duration: f64,
    /// By how much it is longer for an impulse, m/(N s), and by how much its points become faster against each other, 1/kg.
    give: f64,
    answer: DVec3,
    // Of the last step.
    /// By how much it was longer for a force, m/N.
    gave: f64,
}

saved! { Thread {
    length, target, compliance, most, lead, pace, current, reach, gentle, led, speed, apart, line, drift, duration,
    give, answer, gave,
} }

/// A place that goes straight and evenly from one to another over the next step, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lead {
    pub from: DVec3,
    pub to: DVec3,
}

saved! { Lead { from, to } }

impl Lead {
    /// The same way beside it.
    pub fn moved(self, offset: DVec3) -> Self {
        Self {
            from: self.from + offset,
            to: self.to + offset,
        }
    }

    /// As it is to be taken off the sum of a point's parts, which are `whole` together.
    pub fn scaled(self, whole: f64) -> Self {
        Self {
            from: self.from * whole,
            to: self.to * whole,
        }
    }
}

impl Thread {
    /// Of no length, from a point to a place that is led.
    pub fn led(lead: Lead, compliance: f64, most: f64) -> Self {
        Self {
            lead: Some(lead),
            most,
            ..Self::new(0.0, 0.0, compliance)
        }
    }

    pub fn new(length: f64, target: f64, compliance: f64) -> Self {
        Self {
            length,
            target,
            compliance,
            most: f64::INFINITY,
            current: length,
            reach: length,
            gave: compliance,
            ..Self::default()
        }
    }

    /// How long it is at the end of a step of `dt` seconds: it becomes shorter no faster than points that are attached come together.
    pub fn length_after(&self, dt: f32) -> f64 {
        self.target.max(self.length - CLOSING_SPEED * f64::from(dt))
    }

    /// What it stores where its points are so far apart, J.
    pub fn energy(&self, distance: f64) -> f64 {
        let stretch = (distance - self.length).max(0.0);
        if self.gave > 0.0 {
            0.5 * stretch * stretch / self.gave
        } else {
            0.0
        }
    }

    /// Whether it has done no more in the step in progress than to stretch.
    pub fn is_elastic(&self) -> bool {
        let most = self.gave.max(self.give * self.duration);
        self.lead.is_none() && self.target == self.length && most <= self.compliance * (1.0 + 1e-6)
    }

    /// Begins a step of `dt` seconds.
    pub fn begin(&mut self, dt: f32) {
        self.pace = (self.length_after(dt) - self.length) / f64::from(dt);
        self.current = self.length;
        if let Some(Lead { from, to }) = self.lead {
            self.led = from;
            self.speed = (to - from) / f64::from(dt);
        }
    }

    /// Takes a substep as it is to be: its points are `apart` as it begins and go at this velocity against each other; forces act for `duration`
    /// seconds.
    pub fn follow(&mut self, apart: DVec3, velocity: DVec3, answer: DVec3, duration: f32, moment: &Span) {
        // The half kick that closes a step is to leave velocities that go on as they should.
        let part = if moment.drifts { 1.0 } else { 0.5 };
        self.drift = part * f64::from(moment.duration);
        self.duration = f64::from(duration);
        self.give = self.compliance / self.duration;
        self.answer = answer;
        let (apart, velocity) = (apart - self.led, velocity - self.speed);
        self.apart = apart;
        let distance = apart.length();
        let is_resolved = velocity.length() * self.drift <= RESOLVED * distance && distance > 0.0;
        self.line = is_resolved.then(|| apart / distance);
        self.reach = (self.current + self.pace * self.drift).max(0.0);
        // Points that were put further apart than one that does not stretch can be come back gently.
        let is_gentle = self.compliance == 0.0;
        self.gentle = if is_gentle { self.gentlest(distance) } else { 0.0 };
    }

    /// How near its points come in this substep at most where it draws them together gently, m.
    fn gentlest(&self, distance: f64) -> f64 {
        distance - CLOSING_SPEED * self.drift
    }

    /// Contacts keep its points apart in this substep: it gives way to them, and draws gently.
    pub fn loosen(&mut self, moment: &Span) {
        if self.lead.is_none() {
            // The same for a force in a half kick as in a whole one.
            let least = LEAST_GIVE * self.answer.max_element() * f64::from(moment.duration).powi(2) / self.duration;
            self.give = self.give.max(least);
            self.gentle = self.gentlest(self.apart.length());
        }
    }

    /// The substep is over.
    pub fn go_on(&mut self, moment: &Span) {
        if moment.drifts {
            self.current = (self.current + self.pace * self.drift).max(0.0);
            self.led += self.speed * self.drift;
        }
    }

    /// The step in progress, of `dt` seconds, is over.
    pub fn commit(&mut self, dt: f32) {
        self.length = self.length_after(dt);
        self.gave = self.give * self.duration;
    }

    /// The impulse on its first point that this substep takes in all, N s, where the points go at this velocity against each other with what was
    /// `given` so far.
    pub fn impulse(&self, velocity: DVec3, given: DVec3) -> DVec3 {
        let free = self.apart + (velocity - self.speed - self.answer * given) * self.drift;
        // No harder than it is stretched, and no faster than gently.
        let stretched = self.pull(free, self.reach, self.give);
        let pull = if self.gentle > self.reach {
            stretched.min(self.pull(free, self.gentle, 0.0))
        } else {
            stretched
        };
        let line = self.line.unwrap_or(free / free.length());
        if pull > 0.0 && pull.is_finite() {
            -line * pull.min(self.most * self.duration)
        } else {
            DVec3::ZERO
        }
    }

    /// What has its points end as far apart as this, and as it gives way to it, N s; 0 where they end nearer by themselves.
    fn pull(&self, free: DVec3, reach: f64, give: f64) -> f64 {
        let distance = free.length();
        if !(distance > reach) {
            return 0.0;
        }
        let line = self.line.unwrap_or(free / distance);
        // |free - pull way| = reach + pull give, of which the first solution counts.
        let way = self.answer * line * self.drift;
        let square = way.length_squared() - give * give;
        let half = free.dot(way) + reach * give;
        let excess = (distance - reach) * (distance + reach);
        match half * half - square * excess {
            root if root >= 0.0 => excess / (half + root.sqrt()),
            // That far it does not come along this line: as near as it does.
            _ => half / square,
        }
    }
}
