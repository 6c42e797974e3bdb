//! Columns and tuning of the receiver filter.

use drivescope_drive::{params, record};

record! {
    /// What a receiver knows from its ranges alone.
    pub struct GnssEstimate {
        /// North of the local origin.
        north: "m", truth "n";
        /// Sigma of the position to the north.
        north_sigma: "m", sigma_of "north";
        /// East of the local origin.
        east: "m", truth "e";
        /// Sigma of the position to the east.
        east_sigma: "m", sigma_of "east";
        /// Below the local origin.
        down: "m", truth "d";
        /// Sigma of the position downward.
        down_sigma: "m", sigma_of "down";
        /// Latitude.
        lat: "rad", truth "lat";
        /// Longitude.
        lon: "rad", truth "lon";
        /// Height above the ellipsoid.
        alt: "m", truth "alt";
        /// Sigma of the height.
        alt_sigma: "m", sigma_of "alt";
        /// Velocity to the north.
        v_north: "m/s", truth "vn";
        /// Sigma of the velocity to the north.
        v_north_sigma: "m/s", sigma_of "v_north";
        /// Velocity to the east.
        v_east: "m/s", truth "ve";
        /// Sigma of the velocity to the east.
        v_east_sigma: "m/s", sigma_of "v_east";
        /// Velocity downward.
        v_down: "m/s", truth "vd";
        /// Sigma of the velocity downward.
        v_down_sigma: "m/s", sigma_of "v_down";
        /// Offset of the receiver clock, as a distance.
        clock_bias: "m";
        /// Sigma of the clock's offset.
        clock_bias_sigma: "m", sigma_of "clock_bias";
        /// Drift of the receiver clock, as a speed.
        clock_drift: "m/s";
        /// Sigma of the clock's drift.
        clock_drift_sigma: "m/s", sigma_of "clock_drift";
        /// North of the local origin, from this instant's ranges alone; no value with fewer than four satellites.
        fix_north: "m", truth "n";
        /// Sigma of the single fix to the north, if every range has the stated sigma.
        fix_north_sigma: "m", sigma_of "fix_north";
        /// East of the local origin, from this instant's ranges alone.
        fix_east: "m", truth "e";
        /// Sigma of the single fix to the east.
        fix_east_sigma: "m", sigma_of "fix_east";
        /// Below the local origin, from this instant's ranges alone.
        fix_down: "m", truth "d";
        /// Sigma of the single fix downward.
        fix_down_sigma: "m", sigma_of "fix_down";
        /// Satellites in view.
        satellites: "1";
        /// Dilution of the position.
        pdop: "1";
        /// Dilution of the horizontal position.
        hdop: "1";
        /// Dilution of the height.
        vdop: "1";
        /// Squared residuals of the single fix over their variance, per satellite beyond four: about 1 if the ranges agree.
        raim: "1";
        /// 1 where the ranges agree with each other, 0 where one of them must be wrong; no value without a fifth satellite.
        raim_passed: "1";
        /// Satellites left out of the single fix, because the others agree without them; no value without a fifth satellite.
        raim_excluded: "1";
        /// Number of the satellite left out, the first one in view if there are more; no value where none is.
        raim_excluded_satellite: "1";
        /// 1 with fewer than four satellites, or with satellites so close together that a fix means little.
        degraded: "1";
        /// Normalized innovation squared of the ranges, mean over the satellites. Below 1 where errors last for minutes.
        range_nis: "1", nis 1;
        /// Normalized innovation squared of the rates, mean over the satellites.
        range_rate_nis: "1", nis 1;
        /// Share of the ranges that were used.
        range_accepted: "1";
        /// Share of the rates that were used.
        range_rate_accepted: "1";
    }
}

params! {
    /// Tuning of the receiver filter.
    pub struct GnssParams {
        /// Sigma of a pseudorange.
        range_sigma (""): number = 1.5, "m", 0.3 ..= 10.0 Log, from "SPEC navigation 3";
        /// Sigma of the rate of a pseudorange.
        range_rate_sigma (""): number = 0.05, "m/s", 0.02 ..= 1.0 Log, from "SPEC navigation 5";
        /// Density of the acceleration that the filter does not know of. More: turns are followed faster, and noise too.
        acceleration_noise ("sa"): number = 2.0, "m^2/s^3", 0.01 ..= 20.0 Log, from "SPEC navigation 5";
        /// Noise of the receiver clock's offset.
        clock_bias_noise ("sp"): number = 0.009, "m^2/s", 1e-4 ..= 10.0 Log, from "SPEC navigation 4";
        /// Noise of the receiver clock's drift.
        clock_drift_noise ("sf"): number = 0.0355, "m^2/s^3", 1e-5 ..= 10.0 Log, from "SPEC navigation 4";
        /// Probability with which a good range passes its gate.
        gate_probability ("p_gate"): number = 0.999, "1", 0.9 ..= 0.99999 Linear, from "SPEC navigation 3";
        /// Refuse ranges that the filter finds too improbable.
        gate (""): toggle = true, from "SPEC navigation 5";
        /// Probability with which ranges that are all good pass the integrity test.
        integrity_probability (""): number = 0.999, "1", 0.9 ..= 0.99999 Linear, from "SPEC navigation 5, as the gate";
        /// Leave satellites that disagree with the others out of the single fix.
        exclude (""): toggle = true, from "ours, beside the detection of SPEC navigation 5";
    }
}
