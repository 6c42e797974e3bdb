//! Decisions: where to steer, how to pass an obstacle, and which wheels to brake so that the car turns as it should.
//!
//! Knows nothing of how a sensor errs and nothing of plots. Conventions are those of `drivescope_drive`; every
//! transcendental function comes from `libm`, so that a closed loop has the same bits natively and in wasm.
//! Source: Yun & Yu 2007, corrected; SPEC navigation 8 and 9.
//!
//! | module | the room of |
//! |---|---|
//! | [`path`] | a line to follow, sampled |
//! | [`following`] | pure pursuit, Stanley, go-to-goal, and the steering's limits |
//! | [`fixed_gain`] | position by dead reckoning and fixed shares of each fix |
//! | [`vfh`] | vector field histogram: a grid of echoes, sectors, and the direction between them |
//! | [`tyre`] | the lateral tyre of the controller's model |
//! | [`sliding_mode`] | the sliding-mode law with its boundary layer |
//! | [`yaw_moment`] | reference yaw rate, vehicle model, law and brake allocation together |
//!
//! # Example
//!
//! ```
//! use drivescope_control::{Pose, following::pure_pursuit, path::Path};
//! let line = Path::from_segments(&[(50.0, 0.0)]);
//! let pose = Pose { east: 1.0, ..Pose::default() };
//! let target = line.ahead(line.nearest(pose.north, pose.east), 8.0);
//! assert!(pure_pursuit(&pose, (target.north, target.east), 0.8, 8.0) < 0.0, "right of the line, steer left");
//! ```

pub mod fixed_gain;
pub mod following;
pub mod path;
pub mod sliding_mode;
pub mod tyre;
pub mod vfh;
pub mod yaw_moment;

/// What a decision reads of the car: where it is and how it moves, true or estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// North of the local origin, m.
    pub north: f64,
    /// East of the local origin, m.
    pub east: f64,
    /// Heading, clockwise from true north, rad.
    pub yaw: f64,
    /// Forward speed, m/s.
    pub speed: f64,
    /// Speed to the right, m/s.
    pub lateral_speed: f64,
    /// Yaw rate, right positive, rad/s.
    pub yaw_rate: f64,
}

impl Pose {
    /// Whether every number is finite: a decision on anything else is none.
    pub fn is_finite(&self) -> bool {
        [self.north, self.east, self.yaw, self.speed, self.lateral_speed, self.yaw_rate].iter().all(|v| v.is_finite())
    }
}

impl From<[f64; 6]> for Pose {
    /// North, east, yaw, forward speed, speed to the right, yaw rate.
    fn from([north, east, yaw, speed, lateral_speed, yaw_rate]: [f64; 6]) -> Self {
        Self { north, east, yaw, speed, lateral_speed, yaw_rate }
    }
}
