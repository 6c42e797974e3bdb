//! The signals of truth that a simulated or a reference-equipped drive may carry. Never an input of an estimator.

use crate::channel::Column;

macro_rules! truth {
    ($( $name:literal $unit:literal $doc:literal; )+) => {
        /// Every truth signal, named without the `truth_` prefix that files put before it.
        pub static TRUTH_COLUMNS: &[Column] = &[ $( Column::new($name, $unit, $doc).truth($name) ),+ ];
    };
}

truth! {
    "roll" "rad" "Roll of the body.";
    "pitch" "rad" "Pitch of the body.";
    "yaw" "rad" "Yaw of the body.";
    "suspension_roll" "rad" "Roll of the body against the road.";
    "suspension_pitch" "rad" "Pitch of the body against the road.";
    "bank" "rad" "Bank of the road at the vehicle's heading.";
    "grade" "rad" "Grade of the road at the vehicle's heading.";
    "body_pitch" "rad" "Pitch of the body against the road.";
    "sideslip" "rad" "Sideslip at the sensor.";
    "course" "rad" "Course over ground.";
    "vx" "m/s" "Forward velocity.";
    "vy" "m/s" "Rightward velocity.";
    "n" "m" "North of the local origin.";
    "e" "m" "East of the local origin.";
    "d" "m" "Below the local origin.";
    "lat" "rad" "Latitude.";
    "lon" "rad" "Longitude.";
    "alt" "m" "Height above the ellipsoid.";
    "vn" "m/s" "Velocity to the north.";
    "ve" "m/s" "Velocity to the east.";
    "vd" "m/s" "Velocity downward.";
    "gyro_x" "rad/s" "Roll rate of the body without vibration.";
    "gyro_y" "rad/s" "Pitch rate of the body without vibration.";
    "gyro_z" "rad/s" "Yaw rate of the body without vibration.";
    "yaw_rate" "rad/s" "Yaw rate.";
    "mode" "1" "Motion mode: 0 stationary, 1 straight, 2 cornering.";
    "accel_net" "m/s^2" "Forward acceleration over ground.";
    "specific_force_x" "m/s^2" "Forward specific force without sensor errors.";
    "force_xf" "N" "Longitudinal force of the front axle.";
    "force_yf" "N" "Lateral force of the front axle.";
    "force_yr" "N" "Lateral force of the rear axle.";
    "accel_bias_x" "m/s^2" "Bias of the forward accelerometer.";
    "accel_bias_y" "m/s^2" "Bias of the rightward accelerometer.";
    "accel_bias_z" "m/s^2" "Bias of the downward accelerometer.";
    "gyro_bias_x" "rad/s" "Bias of the roll gyro.";
    "gyro_bias_y" "rad/s" "Bias of the pitch gyro.";
    "gyro_bias_z" "rad/s" "Bias of the yaw gyro.";
}

/// The declaration of a truth signal, by its name without prefix.
pub fn truth_column(name: &str) -> Option<&'static Column> {
    TRUTH_COLUMNS.iter().find(|c| c.name == name)
}
