//! Guidance and sliding-mode control: Yun & Yu 2007, figures 5 to 7.

use drivescope_control::Pose;
use drivescope_control::sliding_mode::Law;
use drivescope_drive::drive::Epoch;
use drivescope_estimation::gnss_ins::{GnssIns, GnssInsParams, KnownStart};
use drivescope_simulation::closed_loop::{ClosedLoop, Settings, Start, Summary};

use crate::attempt::{PaperError, Work, json};
use crate::claim::{Claim, Measure, Paper};
use crate::figure::Figure;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "control",
    authors: "Yun & Yu 2007",
    title: "Autonomous Navigation Algorithm Development with Extended Kalman Filter and Sliding Mode Control",
    setting: "The paper gives neither guidance law nor speeds, steering, reference or sampling of its yaw control. Here: the \
              car of its Table 2, pure pursuit, an ultrasonic ring with sectors, satellites good to 15 cm (1.5 m would hide \
              everything), and the gain of the sliding mode corrected.",
    claims: &[
        claim(
            "goal",
            "figures 5c and 5d",
            "From headings wrong by 45 and 20 degrees the vehicle reaches its goal exactly, without following the line.",
            "The filter finds the heading as soon as the vehicle moves; what is left at the goal is the satellites' error.",
            begin_goal,
        ),
        claim(
            "free_line",
            "figure 6a",
            "Without the filter the vehicle strays from a free straight line by about 20 cm and converges to it.",
            "Fixed gains leave the gyro's bias in the heading: the vehicle runs beside the line for good.",
            begin_free_line,
        ),
        claim(
            "obstacle",
            "figures 6b and 6c",
            "Round an obstacle at 10 m, the vehicle returns to its line at 37 m without the filter and at 31 m with it.",
            "The return is set by the look-ahead distance. The filter narrows its spread; the two single runs of the paper \
             cannot show more.",
            begin_obstacle,
        ),
        claim(
            "j_turn",
            "figure 7",
            "Sliding-mode control brings the peak lateral acceleration of a J-turn down from 0.2 g to 0.15 g.",
            "Speed and steering are chosen here to give the first number, the controller's limit to give the second: \
             agreement is by construction. With the printed yaw inertia the brakes first hasten the turn.",
            begin_j_turn,
        ),
        claim(
            "moment_to_zero",
            "section 3.2, text below figure 6",
            "The brakes drive the yaw moment to zero, and the vehicle turns stably.",
            "Read literally, with a yaw rate of zero as the aim, the brakes cancel the steering and the car goes straight on.",
            begin_moment_to_zero,
        ),
        claim(
            "no_steering",
            "section 3.2, text below figure 6",
            "Without steering the input of the controller is zero and it diverges, so that it can only be used in turns.",
            "The equivalent input is well defined without steering: nothing grows.",
            begin_no_steering,
        ),
        claim(
            "reaching",
            "equations (23) and (41)",
            "The gain of (41) makes the state approach the sliding surface under all uncertainties inside the bounds.",
            "The printed gain has the wrong sign in its second part; with the part's magnitude the condition holds. Random \
             plants inside the bounds.",
            begin_reaching,
        ),
        claim(
            "chattering",
            "equations (32) and (33)",
            "A boundary layer makes the control continuous and ends the chattering.",
            "Ups and downs of the moment asked for, per second of the J-turn.",
            begin_chattering,
        ),
        claim(
            "slip",
            "section 4",
            "Removing the tyres' slip with sliding-mode control makes the navigation more exact.",
            "Following its yaw rate keeps the car on its path; what the filter knows of its place hardly changes. A limit below \
             what the path asks for makes the path worse.",
            begin_slip,
        ),
    ],
};

type Begin = fn() -> Result<Box<dyn Work>, PaperError>;

const fn claim(id: &'static str, place: &'static str, says: &'static str, remark: &'static str, begin: Begin) -> Claim {
    Claim { id, place, says, remark, trials: &[], measure: Measure::Own(begin) }
}

/// One closed loop to be run: name of the group that it belongs to is its index in the jobs.
struct Job {
    scenario: &'static str,
    changes: &'static str,
    seeds: u64,
}

const fn job(scenario: &'static str, changes: &'static str, seeds: u64) -> Job {
    Job { scenario, changes, seeds }
}

type Navigator = Box<dyn FnMut(&Epoch) -> Option<Pose>>;

/// Closed loops run one after the other, and the figures read from their summaries.
struct Loops {
    jobs: &'static [Job],
    figures: fn(&[Vec<Summary>]) -> Vec<Figure>,
    done: Vec<Vec<Summary>>,
    running: Option<(ClosedLoop, Navigator)>,
}

impl std::fmt::Debug for Loops {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Loops")
    }
}

impl Loops {
    fn begin(jobs: &'static [Job], figures: fn(&[Vec<Summary>]) -> Vec<Figure>) -> Result<Box<dyn Work>, PaperError> {
        Ok(Box::new(Self { jobs, figures, done: Vec::new(), running: None }))
    }

    /// Index of the group that has seeds left, and the next of them.
    fn next(&self) -> Option<(&'static Job, u64)> {
        let group = self.done.len().checked_sub(1).filter(|&g| self.done[g].len() < self.jobs[g].seeds as usize);
        match group {
            Some(group) => Some((&self.jobs[group], self.done[group].len() as u64 + 1)),
            None => self.jobs.get(self.done.len()).map(|job| (job, 1)),
        }
    }

    fn start(job: &Job, seed: u64) -> Result<(ClosedLoop, Navigator), PaperError> {
        let missing = || PaperError::Missing(["closed loop ", job.scenario].concat());
        let mut settings = Settings::named(job.scenario).ok_or_else(missing)?;
        settings.set_all(&json(job.changes)?).map_err(|e| PaperError::Missing(e.to_string()))?;
        let run = ClosedLoop::new(settings, seed);
        let navigator = navigator(&run.start());
        Ok((run, navigator))
    }
}

/// Seconds driven in one piece of work.
const DRIVEN: f64 = 20.0;

impl Work for Loops {
    fn advance(&mut self) -> Result<Option<Vec<Figure>>, PaperError> {
        if let Some((run, navigator)) = &mut self.running {
            if run.advance(DRIVEN, navigator) {
                let summary = run.summary();
                self.done.last_mut().into_iter().for_each(|group| group.push(summary));
                self.running = None;
            }
            return Ok(None);
        }
        let Some((job, seed)) = self.next() else { return Ok(Some((self.figures)(&self.done))) };
        if seed == 1 {
            self.done.push(Vec::new());
        }
        self.running = Some(Self::start(job, seed)?);
        Ok(None)
    }

    fn fraction(&self) -> f64 {
        let all: u64 = self.jobs.iter().map(|j| j.seeds).sum();
        let done: usize = self.done.iter().map(Vec::len).sum();
        let within = self.running.as_ref().map_or(0.0, |(run, _)| run.fraction());
        ((done as f64 + within) / all as f64).min(0.999)
    }
}

/// The GNSS/INS filter from what may be known before the first epoch.
fn navigator(start: &Start) -> Navigator {
    let params = GnssInsParams { initial_yaw_sigma: start.yaw_sigma.min(1.571), ..GnssInsParams::default() };
    let Start { time, place, velocity, body_to_nav, .. } = *start;
    let mut filter = GnssIns::from_known(&params, &KnownStart { time, place, velocity, body_to_nav });
    Box::new(move |epoch| filter.planar(epoch).map(Pose::from))
}

fn mean(runs: &[Summary], of: fn(&Summary) -> f64) -> f64 {
    let values = runs.iter().map(of).filter(|v| v.is_finite());
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

/// Standard deviation over the runs.
fn spread(runs: &[Summary], of: fn(&Summary) -> f64) -> f64 {
    let middle = mean(runs, of);
    let values = runs.iter().map(of).filter(|v| v.is_finite());
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + (v - middle) * (v - middle), n + 1.0));
    (sum / count).sqrt()
}

fn begin_goal() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[
        job("goal", r#"{"heading_error": 0.7853981633974483}"#, 5),
        job("goal", r#"{"heading_error": -0.3490658503988659}"#, 5),
    ];
    Loops::begin(JOBS, |runs| {
        let of = |runs: &[Summary], from: &str| {
            let miss = mean(runs, |s| s.miss);
            let off = mean(runs, |s| s.max_cross_track);
            [
                Figure::at_most(["distance from the goal, heading wrong by ", from].concat(), "m", miss, 0.5),
                Figure::at_least(["largest offset from the line, heading wrong by ", from].concat(), "m", off, 0.5),
            ]
        };
        [of(&runs[0], "45 deg"), of(&runs[1], "-20 deg")].concat()
    })
}

fn begin_free_line() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[
        job("obstacle_course", r#"{"navigation": "fixed_gain", "obstacle_radius": 0}"#, 10),
        job("obstacle_course", r#"{"obstacle_radius": 0}"#, 10),
    ];
    Loops::begin(JOBS, |runs| {
        let (without, with) = (&runs[0], &runs[1]);
        let largest: fn(&Summary) -> f64 = |s| s.max_cross_track;
        let late = mean(without, |s| s.late_cross_track);
        vec![
            Figure::between("largest offset without the filter, mean of 10", "m", mean(without, largest), 0.1, 0.4)
                .claimed(0.2),
            Figure::at_most("RMS offset beyond 38 m without the filter", "m", late, 0.1),
            Figure::shown("largest offset with the filter, mean of 10", "m", mean(with, largest)),
            Figure::shown("RMS offset beyond 38 m with the filter", "m", mean(with, |s| s.late_cross_track)),
        ]
    })
}

fn begin_obstacle() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[
        job("obstacle_course", r#"{"navigation": "fixed_gain"}"#, 10),
        job("obstacle_course", "{}", 10),
        job("obstacle_course", r#"{"navigation": "truth"}"#, 1),
    ];
    Loops::begin(JOBS, |runs| {
        let (without, with, perfect) = (&runs[0], &runs[1], &runs[2]);
        let back: fn(&Summary) -> f64 = |s| s.return_distance;
        let clearance = with.iter().map(|s| s.clearance).fold(f64::NAN, f64::min);
        let (before, after) = (mean(without, back), mean(with, back));
        vec![
            Figure::at_least("least distance to the obstacle's edge with the filter", "m", clearance, 0.35),
            Figure::between("return to the line with the filter, mean of 10", "m", after, 28.0, 34.0).claimed(31.0),
            Figure::between("return to the line without it, mean of 10", "m", before, 34.0, 40.0).claimed(37.0),
            Figure::at_least("earlier with the filter", "m", before - after, 3.0).claimed(6.0),
            Figure::shown("return to the line if the place were known", "m", mean(perfect, back)),
            Figure::shown("spread of the return without the filter", "m", spread(without, back)),
            Figure::shown("spread of the return with the filter", "m", spread(with, back)),
        ]
    })
}

fn begin_j_turn() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[
        job("j_turn", r#"{"yaw_target": "off"}"#, 1),
        job("j_turn", "{}", 1),
        job("j_turn", r#"{"hold_speed": false}"#, 1),
        job("j_turn", r#"{"plant": "six_dof", "car": "bmw_320i", "V": 20, "delta": 0.05, "yaw_target": "off"}"#, 1),
        job(
            "j_turn",
            r#"{"plant": "six_dof", "car": "bmw_320i", "V": 20, "delta": 0.05, "a_lim": 3.92, "mz_max": 4000}"#,
            1,
        ),
    ];
    Loops::begin(JOBS, |runs| {
        let peak = |index: usize| mean(&runs[index], |s| s.peak_lateral_g);
        vec![
            Figure::between("peak lateral acceleration without control", "g", peak(0), 0.195, 0.205).claimed(0.2),
            Figure::between("peak lateral acceleration with control", "g", peak(1), 0.145, 0.155).claimed(0.15),
            Figure::shown("the same where the brakes may slow the car", "g", peak(2)),
            Figure::shown("largest yaw moment", "N m", mean(&runs[1], |s| s.peak_moment)),
            Figure::shown("largest sideslip without control", "deg", mean(&runs[0], |s| s.peak_sideslip_deg)),
            Figure::shown("largest sideslip with control", "deg", mean(&runs[1], |s| s.peak_sideslip_deg)),
            Figure::shown("saloon at 72 km/h, six degrees of freedom, without control", "g", peak(3)),
            Figure::shown("the same with control, limited to 0.4 g", "g", peak(4)),
        ]
    })
}

fn begin_moment_to_zero() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[job("j_turn", r#"{"yaw_target": "zero"}"#, 1), job("j_turn", r#"{"yaw_target": "off"}"#, 1)];
    Loops::begin(JOBS, |runs| {
        let end = |index: usize| mean(&runs[index], |s| s.end_lateral_g);
        vec![
            Figure::at_least(
                "lateral acceleration in the end, as a share of that without control",
                "1",
                end(0) / end(1),
                0.5,
            ),
            Figure::shown("lateral acceleration in the end", "g", end(0)),
            Figure::shown("largest yaw moment of the brakes", "N m", mean(&runs[0], |s| s.peak_moment)),
        ]
    })
}

fn begin_no_steering() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[job("j_turn", r#"{"delta": 0}"#, 1), job("corner", r#"{"navigation": "fixed_gain"}"#, 1)];
    Loops::begin(JOBS, |runs| {
        let straight = &runs[0];
        let lateral = mean(straight, |s| s.peak_lateral_g);
        vec![
            Figure::at_least("lateral acceleration after 10 s straight on: it diverges", "g", lateral, 0.05),
            Figure::shown("largest yaw moment straight on", "N m", mean(straight, |s| s.peak_moment)),
            Figure::shown(
                "largest offset on a path with straight parts, control on",
                "m",
                mean(&runs[1], |s| s.max_cross_track),
            ),
        ]
    })
}

fn begin_chattering() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[job("j_turn", r#"{"Phi": 0}"#, 1), job("j_turn", "{}", 1)];
    Loops::begin(JOBS, |runs| {
        let variation = |index: usize| mean(&runs[index], |s| s.moment_variation);
        let end = |index: usize| mean(&runs[index], |s| s.end_lateral_g);
        vec![
            Figure::at_least(
                "ups and downs without the layer, per those with it",
                "1",
                variation(0) / variation(1),
                10.0,
            ),
            Figure::at_most("change of the settled lateral acceleration", "g", (end(0) - end(1)).abs(), 0.002),
            Figure::shown("ups and downs without the layer", "N m/s", variation(0)),
            Figure::shown("ups and downs with the layer", "N m/s", variation(1)),
        ]
    })
}

fn begin_slip() -> Result<Box<dyn Work>, PaperError> {
    const JOBS: &[Job] = &[
        job("corner", r#"{"yaw_target": "off"}"#, 5),
        job("corner", "{}", 5),
        job("corner", r#"{"a_lim": 1.4709975}"#, 5),
    ];
    Loops::begin(JOBS, |runs| {
        let path = |index: usize| mean(&runs[index], |s| s.max_cross_track);
        let known = |index: usize| mean(&runs[index], |s| s.position_rms);
        vec![
            Figure::at_most(
                "largest offset from the path with control, as a share of that without",
                "1",
                path(1) / path(0),
                0.5,
            ),
            Figure::at_most(
                "error of the filter's place with control, as a share of that without",
                "1",
                known(1) / known(0),
                0.8,
            ),
            Figure::at_most("largest offset with the limit of 0.15 g, as a share", "1", path(2) / path(0), 0.8),
            Figure::shown("largest offset from the path without control", "m", path(0)),
            Figure::shown("largest offset from the path with control", "m", path(1)),
            Figure::shown("RMS error of the filter's place without control", "m", known(0)),
            Figure::shown("RMS error of the filter's place with control", "m", known(1)),
            Figure::shown("largest sideslip without control", "deg", mean(&runs[0], |s| s.peak_sideslip_deg)),
            Figure::shown("largest sideslip with control", "deg", mean(&runs[1], |s| s.peak_sideslip_deg)),
        ]
    })
}

/// Random plants inside the bounds of the law.
#[derive(Debug)]
struct Reaching;

/// How many plants are tried.
const PLANTS: u32 = 50_000;

fn begin_reaching() -> Result<Box<dyn Work>, PaperError> {
    Ok(Box::new(Reaching))
}

impl Work for Reaching {
    fn advance(&mut self) -> Result<Option<Vec<Figure>>, PaperError> {
        let (mut printed, mut corrected) = (0_u32, 0_u32);
        let mut state = 1_u64;
        for _ in 0..PLANTS {
            let (law, s, input_gain, drift, truth, xi) = plant(&mut state);
            let input = law.input(s, input_gain, drift);
            let part = (1.0 - law.gain_ratio) * input_gain * input.equivalent.abs();
            let gain = law.gain_ratio * (law.model_error + law.reaching_rate) + part;
            let as_printed = input.equivalent - gain * s.signum() / input_gain;
            let fails = |u: f64| s * (truth + input_gain / xi * u) > -law.reaching_rate * s.abs() * (1.0 - 1e-9);
            printed += u32::from(fails(as_printed));
            corrected += u32::from(fails(input.total));
        }
        let share = |count: u32| 100.0 * f64::from(count) / f64::from(PLANTS);
        Ok(Some(vec![
            Figure::at_most("states that do not approach the surface, gain as printed", "%", share(printed), 0.0),
            Figure::shown("states that do not approach it, gain corrected", "%", share(corrected)),
        ]))
    }

    fn fraction(&self) -> f64 {
        0.0
    }
}

/// A law, a state outside its boundary layer, the model there, and a true plant inside the bounds.
fn plant(state: &mut u64) -> (Law, f64, f64, f64, f64, f64) {
    let mut next = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let law =
        Law { reaching_rate: 0.05 + 5.0 * next(), model_error: 2.0 * next(), gain_ratio: 1.0 + next(), boundary: 0.02 };
    let s = if next() < 0.5 { -0.1 } else { 0.1 };
    let (input_gain, drift) = (1.0 / (500.0 + 2000.0 * next()), 10.0 * (next() - 0.5));
    let truth = drift + law.model_error * (2.0 * next() - 1.0);
    // From 1 / xi_max to xi_max.
    let xi = if next() < 0.5 {
        1.0 + (law.gain_ratio - 1.0) * next()
    } else {
        1.0 / (1.0 + (law.gain_ratio - 1.0) * next())
    };
    (law, s, input_gain, drift, truth, xi)
}
