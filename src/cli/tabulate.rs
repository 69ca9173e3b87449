//! `sgdbake tabulate`: a material as a file of measured reflectance, for renderers that read those.

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::selection;
use sgdbake::brdf::{MaskingKind, Reflectance, SgdBrdf};
use sgdbake::encode::GENERATOR;
use sgdbake::material::Material;
use sgdbake::measurement::deviation::Deviation;
use sgdbake::measurement::{Filled, Format, INCIDENCES, Merl, Rgl, merl};
use sgdbake::preview::Model;

/// Stores a material, a fit to it or a measurement as a file of measured reflectance.
///
/// MERL .binary and RGL .bsdf (RGB, isotropic) are written; Mitsuba 3 shows the latter with its
/// plugin 'measured', other renderers read one or both. The error between the file's nodes is
/// measured and stated.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake tabulate --material gold-paint -o gold-paint.bsdf
  sgdbake tabulate --measured paint.csv -o paint.binary")]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// The file to write, .binary (MERL) or .bsdf (RGL); a .binary cannot say who wrote it, and is
    /// replaced only with --force
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The model of the material to store
    #[arg(long, value_enum, default_value_t, conflicts_with = "measured")]
    model: Model,
    /// The masking function of the model 'sgd'
    #[arg(long, value_enum, default_value_t, conflicts_with = "measured")]
    masking: MaskingKind,
    #[command(flatten)]
    writing: Writing,
    /// Machine-readable report
    #[arg(long)]
    json: bool,
}

/// The quantity stored.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct Source {
    /// A catalogue name, or the path of a material file or of a measurement
    #[arg(long, value_name = "MATERIAL")]
    material: Option<String>,
    /// A measurement: MERL .binary, RGL .bsdf or .csv of samples
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
}

/// The object that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    dry_run: bool,
    path: &'a Path,
    format: Format,
    /// `None` in a dry run, or where nothing reflects.
    error: Option<Deviation>,
}

/// A table in either format.
enum Table {
    Merl(Merl),
    Rgl(Box<Rgl>),
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    let format = format(&arguments.output)?;
    let inputs = arguments.source.inputs();
    arguments.check(format, &inputs)?;
    let (name, reflectance) = source(arguments, output)?;
    let error = if arguments.writing.dry_run {
        None
    } else {
        let table = tabulate(format, &name, reflectance.as_ref(), output);
        let file = NewFile::new(&arguments.output, |file| {
            let mut writer = io::BufWriter::new(file);
            // Dropping the writer instead would lose an error of its last write.
            table.write_to(&mut writer).and_then(|()| io::Write::flush(&mut writer))
        });
        arguments.writing.write_all(&[file], &inputs)?;
        Deviation::of(&table, reflectance.as_ref())
    };
    report(arguments, format, error, output)
}

impl Source {
    /// The paths that are read.
    fn inputs(&self) -> Vec<&Path> {
        let material = self.material.as_deref().map(Path::new);
        material.into_iter().chain(self.measured.as_deref()).collect()
    }
}

/// The format by the file's ending.
fn format(path: &Path) -> Result<Format, Failure> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("binary") => Ok(Format::Merl),
        Some("bsdf") => Ok(Format::Rgl),
        _ => Err(Failure::usage(format!("unknown format of {}", path.display()))
            .help("use .binary (MERL) or .bsdf (RGL)")),
    }
}

/// The reflectance to store, and its name.
fn source(
    arguments: &Arguments,
    output: &Output,
) -> Result<(String, Box<dyn Reflectance>), Failure> {
    if let Some(path) = &arguments.source.measured {
        return Ok((measured::name(path), Box::new(measured::read(path)?)));
    }
    let name = arguments.source.material.as_deref().unwrap_or_default();
    let material = selection::material(name, output)?;
    let reflectance: Box<dyn Reflectance> = match arguments.model {
        Model::Sgd => Box::new(exact(&material, arguments.masking)),
        model => model.reflectance(&material)?,
    };
    Ok((material.name, reflectance))
}

/// SGD in double precision, its exact masking from a table.
fn exact(material: &Material, masking: MaskingKind) -> SgdBrdf {
    SgdBrdf::new(material, masking).tabulated()
}

impl Arguments {
    /// Refuses to replace a file of another writer; a MERL file has no room for the writer's name.
    fn check(&self, format: Format, inputs: &[&Path]) -> Result<(), Failure> {
        if format == Format::Merl && self.output.is_file() && !self.writing.force {
            return Err(Failure::job(format!("{} exists", self.output.display()))
                .help("choose another output path, or overwrite it with --force"));
        }
        self.writing.check([self.output.as_path()], inputs)
    }
}

fn tabulate(format: Format, name: &str, reflectance: &dyn Reflectance, output: &Output) -> Table {
    let steps = if format == Format::Merl { merl::SIZE[0] } else { INCIDENCES };
    let bar = output.progress(steps as u64, "tabulate");
    let table = match format {
        Format::Merl => Table::Merl(Merl::tabulate(reflectance, &|| bar.inc(1))),
        // `Rgl::tabulate` would store 0 for pairs without a value; MERL has a mark for them.
        _ => {
            let description = format!("{name}, written by {GENERATOR}");
            let filled = Filled(reflectance);
            Table::Rgl(Box::new(Rgl::tabulate(&filled, description, &|| bar.inc(1))))
        }
    };
    bar.finish_and_clear();
    table
}

impl Table {
    fn write_to(&self, writer: &mut impl io::Write) -> io::Result<()> {
        match self {
            Self::Merl(merl) => merl.write_to(writer),
            Self::Rgl(rgl) => rgl.write_to(writer),
        }
    }
}

impl Reflectance for Table {
    fn eval(&self, wi: glam::DVec3, wo: glam::DVec3) -> [f64; 3] {
        match self {
            Self::Merl(merl) => merl.eval(wi, wo),
            Self::Rgl(rgl) => rgl.eval(wi, wo),
        }
    }
}

fn report(
    arguments: &Arguments,
    format: Format,
    error: Option<Deviation>,
    output: &mut Output,
) -> Result<(), Failure> {
    let dry_run = arguments.writing.dry_run;
    if arguments.json {
        let path = &arguments.output;
        return output.json(&Report { schema: "sgdbake/tabulate/1", dry_run, path, format, error });
    }
    output.written(&arguments.output, arguments.writing)?;
    error.map_or(Ok(()), |Deviation { pairs, median, percentile_95, largest }| {
        let [median, most, largest] = [median, percentile_95, largest].map(|error| 100.0 * error);
        output.line(format!(
            "relative error at {pairs} pairs up to 80° from the normal: median {median:.3} %, \
             95 % of them below {most:.2} %, largest {largest:.1} %"
        ))
    })
}
