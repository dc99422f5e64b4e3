//! Arguments, progress, messages and exit codes: the only place that prints.

mod accuracy;
mod build;
mod cache;
mod calibrate;
mod calibrate_force;
mod calibrate_light;
mod calibrate_optics;
mod calibrate_print;
mod check;
mod compare;
mod dataset;
mod explain;
mod hardness;
mod hardness_lines;
mod illuminate;
mod input;
mod list;
mod live;
mod new;
mod new_scene;
mod of_a_design;
mod output;
pub mod points;
mod recording;
mod rest_frame;
mod schema;
mod shell;
mod simulate;
mod track;
mod tracker_arguments;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use domecast_files::Cache;
use output::{Failure, Output};

pub use output::{CallError, Called};
pub use track::shape_members;

/// From a parameter file to a dome-shaped camera tactile sensor that can be made, calibrated and read.
#[derive(Debug, Parser)]
#[command(name = "domecast", version, about, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Print the result as JSON, for programs.
    #[arg(long, global = true)]
    json: bool,
    /// No progress and no summary; errors are still printed.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Write even where something else than an unchanged earlier result stands: that is kept as NAME.bak-N.
    #[arg(long, global = true)]
    force: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make everything that a design needs: artwork, parts, constants.
    Build {
        /// The design file.
        design: PathBuf,
        /// Where to write [default: output/<design name>].
        #[arg(long)]
        out: Option<PathBuf>,
        /// Show in the report what `domecast accuracy` measured of this design: its folder.
        #[arg(long, value_name = "DIR")]
        accuracy: Option<PathBuf>,
        /// Build again whenever the design file is saved, and keep the open page fresh.
        #[arg(long)]
        watch: bool,
    },
    /// Show what accuracy costs in time: every setting of the design, measured on this machine.
    Accuracy {
        /// The design file.
        design: PathBuf,
        /// Where to write [default: output/<design name>-accuracy].
        #[arg(long)]
        out: Option<PathBuf>,
        /// The scene that frames and runtime are measured on [default: a ball pressed onto the dome].
        #[arg(long)]
        scene: Option<PathBuf>,
        /// A first look in a few seconds: fewer runs, no samples that take long.
        #[arg(long)]
        quick: bool,
    },
    /// Show the light on the dome of a design as it stands: each colour's irradiance, how even it is, and what error of a
    /// normal one grey level makes, as maps on the dome and in the image; and search for better lights.
    Illuminate {
        /// The design file.
        design: PathBuf,
        /// Where to write [default: output/<design name>-light].
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        search: illuminate::LightSearch,
    },
    /// Write a starting design, and the schema for editors beside it: with a radius, one of your own that leaves the rest
    /// to rules; without, one in which every field has its reason.
    New {
        /// Name of the design.
        name: String,
        /// The design to start from: a file, or the name of a shipped one [default: the paper's sensor, thumb24].
        #[arg(long, conflicts_with = "radius")]
        from: Option<PathBuf>,
        /// Write a starting scene for this design instead: a ball pressed onto its dome, under its own lights.
        #[arg(long, value_name = "DESIGN", conflicts_with_all = ["from", "radius"])]
        scene: Option<PathBuf>,
        #[command(flatten)]
        own: new::OwnSensor,
        /// Where to write [default: designs/<name>.json, or <name>.json where there is no such folder; a scene: beside its
        /// design].
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Describe a field of the design file: meaning, allowed values, and the value and reason in thumb24.
    Explain {
        /// The field, as in messages: `springs.wire_diameter_mm`; empty for the list of sections.
        #[arg(default_value = "")]
        field: String,
        /// Show the value and reason of this design.
        #[arg(long)]
        design: Option<PathBuf>,
    },
    /// The catalogue of parts that a design can name by key, as `"from": KEY`.
    List {
        /// Which kind of part.
        #[arg(value_parser = list::kind_parser())]
        kind: domecast_design::catalogue::CatalogueKind,
        /// One part with all its numbers and their sources.
        key: Option<String>,
    },
    /// Two designs or two builds side by side: fields, dots, parts, loads, resolution.
    Compare {
        /// A design file or the folder of a build.
        a: PathBuf,
        /// Another.
        b: PathBuf,
    },
    /// Read a build again and verify it: hashes, meshes, dots against constants.
    Check {
        /// The folder of a build.
        dir: PathBuf,
    },
    /// From pixels to points on the dome.
    Trace {
        /// The design file (only its name, camera, optics and dome are read).
        design: PathBuf,
        /// Pixels: CSV of `u,v`, or a JSON list of [u, v]; `-` for standard input.
        #[arg(long)]
        pixels: PathBuf,
        /// Where the platform is: a JSON 4x4 `rest_from_platform`, mm.
        #[arg(long)]
        pose: Option<PathBuf>,
    },
    /// From points in the sensor frame to pixels.
    Project {
        /// The design file (only its name, camera, optics and dome are read).
        design: PathBuf,
        /// Points: CSV of `x,y,z` in mm, or a JSON list of [x, y, z]; `-` for standard input.
        #[arg(long)]
        points: PathBuf,
        /// Where the platform is: a JSON 4x4 `rest_from_platform`, mm.
        #[arg(long)]
        pose: Option<PathBuf>,
    },
    /// Calibrate a built sensor step by step: lens, rest, known weights, presses of a ball; says what is still unknown, and which load helps most.
    Calibrate(calibrate::CalibrateArguments),
    /// Fit the springs' stiffness to measured pairs of displacement and wrench.
    CalibrateForce {
        /// CSV of `tx,ty,tz,rx,ry,rz` (mm, rad) or `u0,v0,..,u3,v3` (px), then `Fx,Fy,Fz,Mx,My,Mz` (N, N*mm); an
        /// empty cell is a missing axis.
        measured: PathBuf,
        /// The constants.json of the sensor.
        constants: PathBuf,
        /// Where to write [default: constants.measured.json beside the constants].
        #[arg(long)]
        out: Option<PathBuf>,
        /// Standard deviation of the noise of the displacements: `MM,RAD`, or six for tx .. rz [default: of pixels by the
        /// constants' noise; else from what the readings scatter beyond a hundredth of their range].
        #[arg(long, value_parser = calibrate_force::motion_sd)]
        motion_sd: Option<[f64; 6]>,
        /// Temperature of the springs while they were measured, degrees C [default: that of the constants].
        #[arg(long, value_name = "C", allow_negative_numbers = true, value_parser = calibrate_force::celsius)]
        temperature: Option<f64>,
    },
    /// Fit pupil, sheet, indices, markers and dots to what the built sensor sees.
    CalibrateOptics {
        /// A folder of raw PNG frames (or one), or a CSV of `frame,kind,id,u,v`: centroids in the raw image, px. The
        /// first frames, by name or number, are at rest.
        seen: PathBuf,
        /// The constants.json of the sensor.
        constants: PathBuf,
        /// Where to write [default: constants.measured.json beside the constants].
        #[arg(long)]
        out: Option<PathBuf>,
        /// How many frames, from the lowest, are without load: their noise is in all that is measured from rest.
        #[arg(long, default_value_t = 1)]
        rest_frames: usize,
        /// Where to write the centroids found in frames, as the CSV that this command reads.
        #[arg(long)]
        centroids: Option<PathBuf>,
    },
    /// Fit the lights (flux, place, axis, lobe, crosstalk, reflectance, stray light) to a frame at rest and presses of a ball.
    CalibrateLight(calibrate_light::LightArguments),
    /// Draw what the sensor will see, with the exact truth, using only the effects that the scene calls for.
    Simulate {
        /// The scene file.
        scene: PathBuf,
        #[command(flatten)]
        options: simulate::SimulateOptions,
    },
    /// Draw many touches for learning, balanced and split, as shards of a WebDataset.
    Dataset {
        /// The spec of the set.
        spec: PathBuf,
        #[command(flatten)]
        options: dataset::DatasetOptions,
    },
    /// Hardness by contact mechanics, of every video of a data set: a logarithm of Young's modulus with its interval.
    Hardness {
        /// The folder of the set.
        dataset: PathBuf,
        /// Where to write a line of JSON for each video.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Print the JSON schema of the design file.
    Schema {
        /// That of the scene file instead.
        #[arg(long)]
        scene: bool,
        /// That of the spec of a data set instead.
        #[arg(long, conflicts_with = "scene")]
        dataset: bool,
    },
    /// From frames to markers, pose, wrench and local displacement.
    Track(Box<track::TrackArguments>),
    /// Read a camera live: numbers at its rate, on the terminal, as JSON lines, as a page, into a recording.
    Live(Box<live::LiveArguments>),
    /// Print the completions for a shell.
    Completions {
        /// Which shell.
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Print the man page.
    Man,
    /// Fit the pad's map to a measured test print, and write it into a new design file.
    CalibratePrint {
        /// CSV of `id,x_mm,y_mm` (seen from outside, pole at the origin) or `id,phi_deg,theta_deg`, optionally
        /// `print`.
        measured: PathBuf,
        /// The design file from which the test print was made.
        design: PathBuf,
        /// The new design file [default: <design>-measured.json beside the design].
        #[arg(long)]
        out: Option<PathBuf>,
        /// Which artwork was printed [default: the one whose marks fit].
        #[arg(long, value_enum)]
        marks: Option<calibrate_print::Marks>,
    },
}

/// Options whose old names are taken for one version more, each with the name that it has now.
const RENAMED: [(&str, &str); 2] =
    [("--most-residual-px", "--max-residual-px"), ("--most-misplaced", "--max-misplaced")];

/// Says so where an option is given by its old name.
fn note_old_names(output: &Output, arguments: &[OsString]) {
    for given in arguments.iter().skip(1) {
        let given = given.to_string_lossy();
        let name = given.split('=').next().unwrap_or_default();
        if let Some((old, new)) = RENAMED.iter().find(|(old, _)| *old == name) {
            output.warn(&format!("{old} is now called {new}; the next version will not take the old name"));
        }
    }
}

/// Runs the program on the process's arguments.
///
/// Exit codes: 0 done, 1 the input is at fault, 2 usage, 3 our fault.
pub fn run() -> ExitCode {
    ExitCode::from(run_as(&std::env::args_os().collect::<Vec<_>>(), cache::of_program))
}

/// [`run`] on arguments, the program's name first; returns the exit code. An interrupt (Ctrl-C) or a request to terminate ends
/// the process from now on.
pub fn run_with(given: &[OsString]) -> u8 {
    run_as(given, || None)
}

fn run_as(given: &[OsString], cache: fn() -> Option<Cache>) -> u8 {
    let arguments = match Arguments::try_parse_from(given) {
        Ok(arguments) => arguments,
        Err(error) => {
            // help and version are asked for, not errors
            let code = u8::from(error.use_stderr()) * 2;
            // nothing is left to do if even this cannot be printed
            let _ = error.print();
            return code;
        }
    };
    let output = Output::new(arguments.json, arguments.quiet, arguments.force).with_cache(cache);
    note_old_names(&output, given);
    domecast_files::tidy_on_signals();
    for note in domecast_files::recover(given.iter().skip(1).cloned()) {
        output.note(&note);
    }
    match dispatch_safely(&output, &arguments.command) {
        Ok(()) => 0,
        Err(failure) => {
            output.failure(&failure);
            failure.exit_code()
        }
    }
}

/// Runs a command as a function of a library: arguments as on the command line, without the program's name. Nothing is
/// printed, and the process's signals stay its own. For commands that end by themselves and have a result.
///
/// # Errors
/// [`CallError`].
pub fn call(given: &[OsString]) -> Result<Called, CallError> {
    let program = OsString::from("domecast");
    let arguments = Arguments::try_parse_from(std::iter::once(&program).chain(given))
        .map_err(|error| CallError::Other(error.to_string().trim_end().to_owned()))?;
    let output = Output::silent(arguments.force);
    dispatch_safely(&output, &arguments.command).map_err(Failure::into_call_error)?;
    Ok(output.into_called())
}

/// No input should lead to a panic; if one does, it is our fault and has its own exit code.
fn dispatch_safely(output: &Output, command: &Command) -> Result<(), Failure> {
    let ran = std::panic::catch_unwind(|| dispatch(output, command));
    ran.unwrap_or_else(|_| Err(Failure::Internal("it stopped at the place named above".into())))
}

fn dispatch(output: &Output, command: &Command) -> Result<(), Failure> {
    match command {
        Command::Build { design, out, accuracy, watch } => build::run(
            output,
            design,
            &build::Folders { out: out.as_deref(), accuracy: accuracy.as_deref() },
            *watch,
        ),
        Command::Accuracy { design, scene, out, quick } => {
            accuracy::run(output, design, scene.as_deref(), out.as_deref(), *quick)
        }
        Command::Illuminate { design, out, search } => {
            illuminate::run(output, design, out.as_deref(), search)
        }
        Command::New { name, scene: Some(design), out, .. } => {
            new_scene::run(output, name, design, out.as_deref())
        }
        Command::New { name, from, own, out, .. } => {
            new::run(output, name, from.as_deref(), own, out.as_deref())
        }
        Command::Explain { field, design } => explain::run(output, field, design.as_deref()),
        Command::List { kind, key } => list::run(output, *kind, key.as_deref()),
        Command::Compare { a, b } => compare::run(output, a, b),
        Command::Completions { shell } => shell::completions(output, *shell, Arguments::command()),
        Command::Man => shell::man(output, Arguments::command()),
        Command::Check { dir } => check::run(output, dir),
        Command::Trace { design, pixels, pose } => points::trace(output, design, pixels, pose.as_deref()),
        Command::Project { design, points, pose } => points::project(output, design, points, pose.as_deref()),
        Command::Calibrate(arguments) => calibrate::run(output, arguments),
        Command::CalibrateForce { measured, constants, out, motion_sd, temperature } => {
            let known = calibrate_force::Known { motion_sd: *motion_sd, temperature_c: *temperature };
            calibrate_force::run(output, measured, constants, out.as_deref(), &known)
        }
        Command::CalibrateOptics { seen, constants, out, rest_frames, centroids } => {
            let files = calibrate_optics::Files { out: out.as_deref(), centroids: centroids.as_deref() };
            calibrate_optics::run(output, seen, constants, &files, *rest_frames)
        }
        Command::CalibrateLight(arguments) => calibrate_light::run(output, arguments),
        Command::Simulate { scene, options } => simulate::run(output, scene, options),
        Command::Dataset { spec, options } => dataset::run(output, spec, options),
        Command::Hardness { dataset, out } => hardness::run(output, dataset, out.as_deref()),
        Command::Schema { scene, dataset } => schema::run(output, *scene, *dataset),
        Command::Track(arguments) => track::run(output, arguments),
        Command::Live(arguments) => live::run(output, arguments),
        Command::CalibratePrint { measured, design, out, marks } => {
            calibrate_print::run(output, measured, design, out.as_deref(), *marks)
        }
    }
}
