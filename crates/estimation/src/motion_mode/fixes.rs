//! What consecutive satellite fixes say of rest, in a log whose wheels say nothing.
//!
//! A car whose fixes have stayed within a short distance for some seconds stands, whatever its engine shakes; one whose
//! fixes go steadily on moves. Both are said with reserve: a receiver at rest wanders and jumps, and one without reception,
//! or that holds its place on purpose, repeats its last fix while the car moves. So fixes that came to a halt from a speed
//! that no car leaves at once, and for a while all fixes after a leap from a place at which they stayed, say nothing of rest;
//! and neither a leap nor a wander is motion.

use drivescope_drive::geodesy::radii;
use drivescope_drive::signals::Gnss;

/// Time over which fixes are compared where they are fine enough, and where that is not known or they are coarser, s.
const WINDOW: f64 = 2.0;
const LONG_WINDOW: f64 = 4.0;

/// Distance within which fixes stay, m: 0.125 m/s over the window.
const STAYS: f64 = 0.25;

/// Smallest step between fixes above which they are too coarse to tell rest from creeping, m.
const COARSE: f64 = 0.5;

/// Age of a fix up to which it counts, and gap after which the comparison begins anew, s.
const LARGEST_AGE: f64 = 2.5;

/// Speed from which fixes do not come to a halt within one step, m/s: 4 m/s^2 at one fix a second.
const FASTEST_HALT: f64 = 4.0;

/// How far fixes leap, m, from a place at which they stayed: more than this and what 5 m/s^2 make of the step.
const LEAP: f64 = 1.0;
const HALF_LARGEST_ACCELERATION: f64 = 2.5;

/// Time after a leap for which fixes that stay say nothing, s: longer than a receiver repeats a fix again and again.
const DISTRUST: f64 = 20.0;

/// Speed that fixes must keep up to contradict rest, m/s, and how even their steps must be.
const CLEARLY_MOVING: f64 = 4.0;
const EVEN: f64 = 0.5;

/// Fixes kept, and the least time between two of them, s: enough for the long window and what was before it.
const KEPT: usize = 24;
const SPACING: f64 = 0.25;

/// What fixes say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Nothing.
    Unknown,
    /// They go on: the car moves.
    Go,
    /// They stay: the car stands.
    Stay,
}

#[derive(Clone, Copy, Debug, Default)]
struct Place {
    time: f64,
    north: f64,
    east: f64,
}

impl Place {
    fn distance(&self, other: &Self) -> f64 {
        (self.north - other.north).hypot(self.east - other.east)
    }
}

/// The last fixes, and what they say.
#[derive(Clone, Debug)]
pub(super) struct Fixes {
    /// Oldest first; the newest is not later than the last fix by more than the spacing.
    places: [Place; KEPT],
    count: usize,
    last: Place,
    /// Latitude and longitude of the first fix, rad, and metres per radian of each.
    origin: Option<[f64; 4]>,
    /// Smallest step along an axis so far, m.
    resolution: f64,
    verdict: Verdict,
    /// Whether fixes stay after a halt that no car makes.
    is_frozen: bool,
    distrusted_until: f64,
}

impl Fixes {
    pub(super) fn new() -> Self {
        Self {
            places: [Place::default(); KEPT],
            count: 0,
            last: Place { time: f64::NEG_INFINITY, ..Place::default() },
            origin: None,
            resolution: f64::INFINITY,
            verdict: Verdict::Unknown,
            is_frozen: false,
            distrusted_until: f64::NEG_INFINITY,
        }
    }

    /// Forget where the car was: its speed is known to be none of rest's.
    pub(super) fn forget(&mut self) {
        (self.count, self.verdict, self.is_frozen) = (0, Verdict::Unknown, false);
    }

    /// Take in a usable fix; one without a place, or hardly earlier than the last, is left out.
    pub(super) fn push(&mut self, time: f64, fix: &Gnss) {
        let Some(place) = self.place(time, fix) else { return };
        if (time - self.last.time).abs() > LARGEST_AGE {
            self.forget();
        } else {
            self.compare(&place);
        }
        self.last = place;
        if self.count > 0 && time - self.places[self.count - 1].time < SPACING {
            return;
        }
        if self.count == KEPT {
            self.places.copy_within(1.., 0);
            self.count -= 1;
        }
        self.places[self.count] = place;
        self.count += 1;
        self.judge();
    }

    /// What the fixes say at a time.
    pub(super) fn verdict(&self, time: f64) -> Verdict {
        if (time - self.last.time).abs() <= LARGEST_AGE { self.verdict } else { Verdict::Unknown }
    }

    /// Metres from the first fix; a flat Earth is right over the seconds that are compared.
    fn place(&mut self, time: f64, fix: &Gnss) -> Option<Place> {
        let (mut north, mut east) = (fix.north, fix.east);
        if !(north.is_finite() && east.is_finite()) {
            let [lat, lon, to_north, to_east] = *self.origin.get_or_insert_with(|| {
                let (meridian, transverse) = radii(fix.lat);
                [fix.lat, fix.lon, meridian, transverse * fix.lat.cos()]
            });
            (north, east) = ((fix.lat - lat) * to_north, (fix.lon - lon) * to_east);
            if !(north.is_finite() && east.is_finite()) {
                self.origin = self.origin.filter(|o| o.iter().all(|v| v.is_finite()));
                return None;
            }
        }
        let is_next = time > self.last.time || self.last.time - time > LARGEST_AGE;
        (is_next && time < f64::INFINITY).then_some(Place { time, north, east })
    }

    /// What the step from the last fix says of the receiver: how fine its fixes are, and whether they leap.
    fn compare(&mut self, place: &Place) {
        for step in [place.north - self.last.north, place.east - self.last.east] {
            // Rounding of an angle makes steps of nanometres.
            if step.abs() > 1e-4 {
                self.resolution = self.resolution.min(step.abs());
            }
        }
        let dt = place.time - self.last.time;
        if self.verdict == Verdict::Stay && place.distance(&self.last) > LEAP + HALF_LARGEST_ACCELERATION * dt * dt {
            self.distrusted_until = place.time + DISTRUST;
        }
    }

    fn judge(&mut self) {
        let places = &self.places[..self.count];
        let Some((now, before)) = places.split_last() else { return };
        let window = if self.resolution <= STAYS { WINDOW } else { LONG_WINDOW };
        // A receiver's clock may be early by some milliseconds.
        let is_long_ago = |p: &Place| now.time - p.time >= 0.95 * window;
        let near = before.iter().rev().take_while(|p| p.distance(now) <= STAYS).count();
        let stays = before[before.len() - near..].iter().any(is_long_ago);
        if !stays {
            self.is_frozen = false;
            self.verdict = if goes_on(places) { Verdict::Go } else { Verdict::Unknown };
            return;
        }
        if self.verdict != Verdict::Stay && near < before.len() {
            let (halt, from) = (&before[before.len() - near], &before[before.len() - near - 1]);
            self.is_frozen |= halt.distance(from) > FASTEST_HALT * (halt.time - from.time);
        }
        let is_coarse = self.resolution > COARSE && self.resolution < f64::INFINITY;
        let is_believed = !self.is_frozen && !is_coarse && now.time >= self.distrusted_until;
        self.verdict = if is_believed { Verdict::Stay } else { Verdict::Unknown };
    }
}

/// Whether fixes have gone on for the longer of the windows at a speed and in a direction that hardly change.
fn goes_on(places: &[Place]) -> bool {
    let Some((now, before)) = places.split_last() else { return false };
    let Some(first) = before.iter().rposition(|p| now.time - p.time >= 0.95 * WINDOW) else { return false };
    let since = &places[first..];
    let time = now.time - since[0].time;
    let (north, east) = ((now.north - since[0].north) / time, (now.east - since[0].east) / time);
    let speed2 = north * north + east * east;
    let is_even = |w: &[Place]| {
        let along = (w[1].north - w[0].north) * north + (w[1].east - w[0].east) * east;
        let share = along / (speed2 * (w[1].time - w[0].time));
        (share - 1.0).abs() <= EVEN
    };
    since.len() > 2 && speed2 > CLEARLY_MOVING * CLEARLY_MOVING && since.windows(2).all(is_even)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What fixes at a rate say at each of them, from places in metres north and east.
    fn verdicts(fixes: &mut Fixes, start: f64, rate: f64, places: impl Iterator<Item = [f64; 2]>) -> Vec<Verdict> {
        let fix = |[north, east]: [f64; 2]| Gnss { north, east, ..Gnss::default() };
        (places.enumerate())
            .map(|(k, place)| {
                let time = start + k as f64 / rate;
                fixes.push(time, &fix(place));
                fixes.verdict(time)
            })
            .collect()
    }

    fn all(rate: f64, seconds: f64, place: impl Fn(f64) -> [f64; 2]) -> Vec<Verdict> {
        verdicts(&mut Fixes::new(), 0.0, rate, (0..(rate * seconds) as usize).map(|k| place(k as f64 / rate)))
    }

    /// Catches a stop that is never told, one told of a car that creeps, and a latitude in place of metres.
    #[test]
    fn a_car_that_halts_stays_and_one_that_creeps_does_not() {
        for rate in [0.5, 1.0, 10.0] {
            // 6 m/s, and 2 m/s^2 from 10 s on; with the noise of a receiver over seconds.
            let halt =
                |t: f64| [6.0 * t.min(10.0) + 9.0 - (13.0 - t.clamp(10.0, 13.0)).powi(2), 0.03 * (2.9 * t).sin()];
            let found = all(rate, 25.0, halt);
            let at = |t: f64| found[(t * rate) as usize];
            assert_eq!((at(17.0), at(23.0)), (Verdict::Stay, Verdict::Stay), "{rate} Hz");
            assert_eq!(at(9.0) == Verdict::Go, rate >= 1.0, "three fixes in two seconds tell motion, {rate} Hz");
            assert!(found[..(13.0 * rate) as usize].iter().all(|v| *v != Verdict::Stay), "{rate} Hz");
        }
        assert!(all(1.0, 60.0, |t| [0.2 * t, 0.0]).iter().all(|v| *v == Verdict::Unknown));
        // As far as 0.57 m a second would be at the equator.
        let mut fixes = Fixes::new();
        for k in 0..8 {
            let lon = 0.5 + f64::from(k) * 0.9e-7;
            fixes.push(f64::from(k), &Gnss { lat: 1.4, lon, ..Gnss::default() });
        }
        assert_eq!(fixes.verdict(7.0), Verdict::Stay, "0.1 m a second to the east at 80 degrees");
    }

    /// Catches motion told of a parked car under trees, and rest told where a place has just leapt.
    #[test]
    fn a_wander_and_a_leap_of_a_car_at_rest_are_no_motion() {
        let wander = |t: f64| [8.0 * (t / 12.0).sin(), 5.0 * (t / 7.0).cos() + 0.2 * (3.1 * t).sin()];
        assert!([1.0, 5.0].iter().all(|rate| all(*rate, 300.0, wander).iter().all(|v| *v != Verdict::Go)));
        // A leap looks like a halt from 12 m/s, which is not believed until the fixes go on and halt again.
        let leap =
            |t: f64| [0.02 * (1.7 * t).sin() + if t < 20.0 { 0.0 } else { 12.0 + (t - 50.0).clamp(0.0, 10.0) }, 0.0];
        let found = all(1.0, 80.0, leap);
        assert_eq!((found[19], found[75]), (Verdict::Stay, Verdict::Stay));
        assert!(found[20..60].iter().all(|v| *v == Verdict::Unknown));
    }

    /// Catches rest told in a tunnel where the receiver repeats its last fix, of a logger that repeats each fix for seconds,
    /// and of fixes so coarse that a creeping car seems to stay.
    #[test]
    fn frozen_and_coarse_fixes_are_not_believed() {
        let tunnel = |t: f64| [15.0 * t.min(30.0), 0.01 * (2.3 * t).sin()];
        for rate in [1.0, 5.0] {
            assert!(all(rate, 90.0, tunnel).iter().all(|v| *v != Verdict::Stay), "{rate} Hz");
        }
        let repeated = |t: f64| [8.0 * (t / 6.0).floor() * 6.0, 0.01 * (2.3 * t).sin()];
        assert!(all(10.0, 90.0, repeated)[60..].iter().all(|v| *v != Verdict::Stay));
        let coarse = |t: f64| [1.1 * (0.2 * t / 1.1).floor(), 0.0];
        assert!(all(1.0, 90.0, coarse)[7..].iter().all(|v| *v != Verdict::Stay));
    }

    /// Catches a fix that counts for ever, and one that is no place or comes from the past.
    #[test]
    fn old_and_bad_fixes_say_nothing() {
        let mut fixes = Fixes::new();
        assert_eq!(*verdicts(&mut fixes, 0.0, 1.0, [[1.0, 1.0]; 8].into_iter()).last().unwrap(), Verdict::Stay);
        for (time, north) in [(7.5, f64::NAN), (6.5, 90.0), (f64::NAN, 90.0), (f64::INFINITY, 90.0)] {
            fixes.push(time, &Gnss { north, east: 1.0, ..Gnss::default() });
        }
        assert_eq!((fixes.verdict(9.0), fixes.verdict(9.6)), (Verdict::Stay, Verdict::Unknown));
        let again = verdicts(&mut fixes, 40.0, 1.0, [[1.0, 1.0]; 3].into_iter());
        assert_eq!(again, [Verdict::Unknown; 3], "what was before a gap does not count");
        // A clock that leapt ahead, and back.
        fixes.push(1e9, &Gnss { north: 1.0, east: 1.0, ..Gnss::default() });
        let back = verdicts(&mut fixes, 50.0, 1.0, [[1.0, 1.0]; 8].into_iter());
        assert_eq!((back[0], back[7]), (Verdict::Unknown, Verdict::Stay));
    }
}
