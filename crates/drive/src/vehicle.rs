//! The vehicle: one set of parameters that estimators and the simulator share, and named cars with their source.

use crate::params;

params! {
    /// Mass, geometry, suspension and tyres of a car. Roll and pitch act about an axis at rest on the road's plane.
    pub struct VehicleParams {
        /// Mass of the whole car.
        mass ("m"): number = 1093.3, "kg", 100.0 ..= 5000.0 Linear, from "CommonRoad vehicle 2 (BMW 320i)";
        /// Mass carried by the suspension.
        sprung_mass ("m_s"): number = 965.711, "kg", 80.0 ..= 4500.0 Linear, from "CommonRoad vehicle 2";
        /// Centre of gravity to the front axle.
        cg_to_front ("l_f"): number = 1.1562, "m", 0.2 ..= 3.0 Linear, from "CommonRoad vehicle 2";
        /// Centre of gravity to the rear axle.
        cg_to_rear ("l_r"): number = 1.42272, "m", 0.2 ..= 3.0 Linear, from "CommonRoad vehicle 2";
        /// Height of the centre of gravity above the ground.
        cg_height ("h"): number = 0.614, "m", 0.1 ..= 1.5 Linear, from "CommonRoad vehicle 2";
        /// Sprung mass above the roll and pitch axis.
        sprung_cg_arm ("h_s"): number = 0.48, "m", 0.05 ..= 1.2 Linear, from "cg height less an assumed axis height of 0.13 m";
        /// Distance between the wheels of an axle.
        track ("tw"): number = 1.39, "m", 0.5 ..= 2.5 Linear, from "CommonRoad vehicle 2, mean of the axles";
        /// Roll inertia about the roll axis.
        roll_inertia ("I_x"): number = 429.77, "kg m^2", 20.0 ..= 4000.0 Linear, from "CommonRoad vehicle 2, shifted to the axis";
        /// Pitch inertia about the pitch axis.
        pitch_inertia ("I_y"): number = 1788.32, "kg m^2", 50.0 ..= 12000.0 Linear, from "CommonRoad vehicle 2";
        /// Yaw inertia.
        yaw_inertia ("I_z"): number = 1791.6, "kg m^2", 50.0 ..= 12000.0 Linear, from "CommonRoad vehicle 2";
        /// Roll stiffness of both axles.
        roll_stiffness ("k_x"): number = 51339.0, "N m/rad", 2e3 ..= 3e5 Log, from "CommonRoad vehicle 2, lumped";
        /// Roll damping of both axles.
        roll_damping ("b_x"): number = 3251.0, "N m s/rad", 1e2 ..= 5e4 Log, from "CommonRoad vehicle 2, lumped";
        /// Pitch stiffness.
        pitch_stiffness ("k_y"): number = 144864.0, "N m/rad", 5e3 ..= 8e5 Log, from "CommonRoad vehicle 2, lumped";
        /// Pitch damping.
        pitch_damping ("b_y"): number = 11452.0, "N m s/rad", 2e2 ..= 1e5 Log, from "CommonRoad vehicle 2, lumped";
        /// Cornering stiffness of the front tyres per unit of load.
        front_cornering ("K_f"): number = 19.73, "1/rad", 4.0 ..= 60.0 Linear, from "CommonRoad vehicle 2, lowered 10 % for understeer";
        /// Cornering stiffness of the rear tyres per unit of load.
        rear_cornering ("K_r"): number = 21.92, "1/rad", 4.0 ..= 60.0 Linear, from "CommonRoad vehicle 2";
        /// Tyre-road friction.
        friction ("mu"): number = 1.0489, "1", 0.05 ..= 2.0 Linear, from "CommonRoad vehicle 2";
        /// Steering wheel angle over road wheel angle.
        steering_ratio ("i_s"): number = 16.0, "1", 1.0 ..= 40.0 Linear, from "placeholder: common saloons have 14 to 18";
    }
}

/// A named car.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Name in menus and on the command line.
    pub name: &'static str,
    /// What it is and where its numbers are from.
    pub doc: &'static str,
    /// The parameters that differ from the defaults, by symbol.
    changes: &'static [(&'static str, f64)],
}

/// The cars that ship with Drivescope.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "bmw_320i",
        doc: "BMW 320i of the CommonRoad vehicle models (vehicle 2), suspension lumped to one roll and one pitch spring",
        changes: &[],
    },
    Preset {
        name: "ford_escort",
        doc: "Ford Escort of the CommonRoad vehicle models (vehicle 1), lumped as vehicle 2 is, tyres of vehicle 2",
        changes: &[
            ("m", 1225.9),
            ("m_s", 1094.5),
            ("l_f", 0.88392),
            ("l_r", 1.50876),
            ("h", 0.558),
            ("h_s", 0.464),
            ("tw", 1.4067),
            ("I_x", 480.1),
            ("I_y", 1578.3),
            ("I_z", 1538.9),
            ("k_x", 56216.0),
            ("b_x", 2888.0),
            ("k_y", 133916.0),
            ("b_y", 8925.0),
        ],
    },
    Preset {
        name: "kim_2014",
        doc: "Table 2 of Kim, Kim & Lee 2014 as printed: the split of the wheelbase puts 81 % of the weight on the front axle",
        changes: &[
            ("m", 1999.1),
            ("m_s", 1780.0),
            ("l_f", 0.54122),
            ("l_r", 2.30378),
            ("I_z", 2573.4),
            ("I_y", 2573.4),
            ("k_y", 130000.0),
            ("b_y", 12000.0),
        ],
    },
    Preset {
        name: "saloon",
        doc: "A plausible front-driven saloon on the wheelbase of Kim et al. 2014: 1750 kg, 60 % on the front axle",
        changes: &[
            ("m", 1750.0),
            ("m_s", 1560.0),
            ("l_f", 1.13),
            ("l_r", 1.715),
            ("I_z", 3200.0),
            ("I_y", 2900.0),
            ("I_x", 650.0),
            ("k_x", 75000.0),
            ("b_x", 5200.0),
            ("k_y", 210000.0),
            ("b_y", 17000.0),
            ("tw", 1.56),
            ("h", 0.55),
            ("h_s", 0.45),
        ],
    },
    Preset {
        name: "vw_vanagon",
        doc: "VW Vanagon of the CommonRoad vehicle models (vehicle 3), lumped as vehicle 2 is, tyres of vehicle 2: a tall van",
        changes: &[
            ("m", 1478.9),
            ("m_s", 1316.6),
            ("l_f", 1.15079),
            ("l_r", 1.32114),
            ("h", 0.748),
            ("h_s", 0.674),
            ("tw", 1.5591),
            ("I_x", 1078.9),
            ("I_y", 2803.3),
            ("I_z", 2473.1),
            ("k_x", 129913.0),
            ("b_x", 6281.6),
            ("k_y", 225512.0),
            ("b_y", 16040.0),
        ],
    },
    Preset {
        name: "yun_2007",
        doc: "Table 2 of Yun & Yu 2007: a small all-terrain vehicle whose yaw inertia is implausibly large",
        changes: &[("m", 800.0), ("m_s", 700.0), ("l_f", 0.4), ("l_r", 0.4), ("I_z", 1200.0), ("tw", 0.8), ("mu", 1.0)],
    },
];

impl VehicleParams {
    /// A named car; `None` if there is none of that name.
    pub fn preset(name: &str) -> Option<Self> {
        let preset = PRESETS.iter().find(|p| p.name == name)?;
        let mut vehicle = Self::default();
        for (symbol, value) in preset.changes {
            crate::param::Params::set(&mut vehicle, symbol, &serde_json::json!(value)).ok()?;
        }
        Some(vehicle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::param::Params;

    #[test]
    fn every_named_car_is_inside_its_own_ranges() {
        for p in PRESETS {
            VehicleParams::preset(p.name).unwrap_or_else(|| panic!("{}", p.name)).validate().unwrap();
        }
        assert_eq!(VehicleParams::preset("kim_2014").unwrap().cg_to_front, 0.54122);
        assert!(VehicleParams::preset("none").is_none());
    }
}
