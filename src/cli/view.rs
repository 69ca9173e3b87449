//! `sgdbake view`: one page that shows a scene or balls, exactly and as glTF.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use crate::cli::failure::Failure;
use crate::cli::measured;
use crate::cli::output::{NewFile, Output, Writing};
use crate::cli::scene_file::unreadable;
use crate::cli::selection::{Chosen, MaterialParser, chosen};
use sgdbake::asset::{Asset, EXTENSION, Subject, build_with_progress};
use sgdbake::encode::Format;
use sgdbake::lut::{Depths, Extent, Request};
use sgdbake::material::{Edition, SUFFIX};
use sgdbake::measurement::Filled;
use sgdbake::report::distance::Reference;
use sgdbake::report::measured_table::MeasuredTable;
use sgdbake::report::view::{Caption, View};
use sgdbake::scene::{Bytes, Scene, SceneError, SlotId};

/// Writes a page that shows a scene with measured materials, or balls: exact on one side of a line,
/// as plain glTF on the other.
///
/// The page is one file. It opens from disk in any browser with WebGL 2, on a phone too, and loads
/// nothing from elsewhere. Turn the view, the sun and the environment; see the colour difference,
/// the parameters and their stated errors.
///
/// Of a catalogue material both editions are shown. A measurement is shown under the sun alone.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  sgdbake view teapot.glb -o teapot.html
  sgdbake view --material gold-paint --measured gold-paint.binary -o gold-paint.html")]
pub struct Arguments {
    /// The scene: a .glb or .gltf that 'sgdbake export' put measured materials into
    #[arg(
        value_name = "SCENE",
        required_unless_present_any = ["material", "measured"],
        conflicts_with_all = ["material", "measured"]
    )]
    scene: Option<PathBuf>,
    /// A catalogue name, or the path of a material file or of a measurement. Repeat for more
    #[arg(
        long,
        value_name = "MATERIAL",
        value_parser = MaterialParser,
        hide_possible_values = true
    )]
    material: Vec<String>,
    /// A measurement to show beside the materials: MERL .binary, RGL .bsdf or .csv of samples;
    /// without a material, beside the one that is fitted to it
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
    /// The page to write, .html
    #[arg(short, long, value_name = "OUT.html")]
    output: PathBuf,
    #[command(flatten)]
    writing: Writing,
}

/// Runs the command.
pub fn run(arguments: &Arguments, output: &mut Output) -> Result<(), Failure> {
    check_name(&arguments.output)?;
    let inputs = arguments.inputs();
    arguments.writing.check([arguments.output.as_path()], &inputs)?;
    let view = match &arguments.scene {
        Some(path) => of_scene(path, output)?,
        None => arguments.of_balls(output)?,
    };
    let page = NewFile::new(&arguments.output, |file| view.write_to(file));
    arguments.writing.write_all(&[page], &inputs)?;
    output.written(&arguments.output, arguments.writing)
}

fn check_name(path: &Path) -> Result<(), Failure> {
    let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("html" | "htm") => Ok(()),
        _ => Err(Failure::usage(format!("{} has no file extension of a page", path.display()))
            .help("name a .html file to write")),
    }
}

impl Arguments {
    fn inputs(&self) -> Vec<&Path> {
        let paths = self.scene.iter().chain(&self.measured).map(PathBuf::as_path);
        paths.chain(self.material.iter().map(Path::new)).collect()
    }

    fn of_balls(&self, output: &Output) -> Result<View, Failure> {
        let mut shown = Vec::new();
        for name in &self.material {
            shown.extend(editions(chosen(name, output)?));
        }
        if let (Some(path), true) = (&self.measured, shown.is_empty()) {
            let (surface, fit) = measured::fitted(path, output)?;
            shown.push(Chosen::fitted(path, &surface, fit));
        }
        balls(&shown, self.measured.as_deref().map(measurement).transpose()?)
    }
}

/// Both editions of a material of the catalogue; else the material itself.
pub fn editions(chosen: Chosen) -> Vec<Chosen> {
    if Edition::of(&chosen.material).is_none() {
        return vec![chosen];
    }
    let both = [Edition::Published, Edition::Refit].into_iter();
    both.filter_map(|edition| edition.material(&chosen.material.name))
        .map(|material| material.clone().into())
        .collect()
}

/// The page of balls in these materials, each once.
pub fn balls(
    shown: &[Chosen],
    measurement: Option<(Caption, MeasuredTable)>,
) -> Result<View, Failure> {
    let mut once: Vec<&Chosen> = Vec::new();
    for chosen in shown {
        // The editions of two arguments may be the same, as for `chrome` and `chrome@refit`.
        if !once.iter().any(|known| known.material == chosen.material) {
            once.push(chosen);
        }
    }
    let assets = assets(&once)?;
    let names: Vec<&str> = once.iter().map(|chosen| chosen.material.name.as_str()).collect();
    let scene = Scene::balls(BALL_ROWS, &names)?;
    let slots: Vec<(SlotId, &Asset)> =
        // `Scene::balls` gives each ball the material at its own index.
        assets.iter().enumerate().map(|(index, asset)| (SlotId::Material(index), asset)).collect();
    Ok(View {
        title: title(&names),
        note: NOTE.to_owned(),
        balls: assets.iter().map(caption).collect(),
        measurement,
        glb: glb(&scene, &slots)?,
    })
}

/// Rows of quads on a ball.
const BALL_ROWS: u16 = 64;

/// The note on the two sides of the line.
const NOTE: &str = "Exact on the left of the line, the glTF material on the right";

/// The materials without textures, which the page does not read.
fn assets(shown: &[&Chosen]) -> Result<Vec<Asset>, Failure> {
    let request = Request {
        quantities: Vec::new(),
        masking: Default::default(),
        // The smallest size that is accepted; without quantities nothing is baked.
        extent: Extent::Size(2),
        depths: Depths::Smallest,
    };
    let subjects: Vec<Subject<'_>> = shown.iter().map(|chosen| chosen.subject()).collect();
    Ok(build_with_progress(&subjects, &request, Format::Exr, &|| ())?.assets)
}

/// The names without their editions, each once.
fn title(names: &[&str]) -> String {
    let mut known = HashSet::new();
    let bare = names.iter().map(|name| name.strip_suffix(SUFFIX).unwrap_or(name));
    let once: Vec<&str> = bare.filter(|name| known.insert(*name)).collect();
    match once[..] {
        [a] => a.to_owned(),
        [a, b] => format!("{a} and {b}"),
        [a, b, c] => format!("{a}, {b} and {c}"),
        _ => format!("{} materials", once.len()),
    }
}

fn caption(asset: &Asset) -> Caption {
    let name = &asset.material.parameters.name;
    let mut editions = [Edition::Published, Edition::Refit].into_iter();
    let kind =
        // An edition finds its material by the name of either, so the names are compared.
        match editions.find(|edition| edition.material(name).is_some_and(|m| m.name == *name)) {
            Some(Edition::Published) => "published fit",
            Some(Edition::Refit) => "refit",
            None => "fit",
        };
    let surface = asset.material.error.as_ref().map(|error| error.delta_e);
    Caption { title: name.clone(), note: kind.to_owned(), surface }
}

/// A measurement as the page shows it, and how near its table is, rounded up to 0.01.
fn measurement(path: &Path) -> Result<(Caption, MeasuredTable), Failure> {
    let measurement = measured::read(path)?;
    let averaged = measurement.averaged();
    let filled = Filled(&averaged);
    let table = MeasuredTable::of(&filled);
    let error = Reference::new(&filled).distance(&table).suns;
    let note = format!(
        "measurement, under the sun alone, to ΔE2000 {:.2}",
        (100.0 * error).ceil() / 100.0
    );
    Ok((Caption { title: measured::name(path), note, surface: None }, table))
}

/// The page of a scene.
fn of_scene(path: &Path, output: &Output) -> Result<View, Failure> {
    let scene = Scene::open(path).map_err(|error| match error {
        SceneError::Kind(_) => Failure::usage(format!("{}: {error}", path.display()))
            .help("name a .glb or .gltf that 'sgdbake export' wrote"),
        error => unreadable(path, error),
    })?;
    check_readable(&scene, path)?;
    let measured = check_measured(&scene, path, output)?;
    scene.warnings().iter().for_each(|warning| output.note(format_args!("warning: {warning}")));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let slots = scene.slots().len();
    Ok(View {
        title: file.into_owned(),
        note: if measured == slots {
            NOTE.to_owned()
        } else {
            format!("{NOTE}; {measured} of {slots} materials are measured")
        },
        balls: Vec::new(),
        measurement: None,
        glb: glb(&scene, &[])?,
    })
}

/// Compressions that need a decoder which the page does not hold.
const UNREADABLE: [&str; 2] = ["KHR_draco_mesh_compression", "KHR_texture_basisu"];

fn check_readable(scene: &Scene, path: &Path) -> Result<(), Failure> {
    let mut used = scene.extensions_used().iter();
    match used.find(|extension| UNREADABLE.contains(&extension.as_str())) {
        Some(extension) => Err(Failure::job(format!(
            "{}: it uses {extension}, which the page cannot read",
            path.display()
        ))
        .help("export the scene without that compression; meshopt compression is read")),
        None => Ok(()),
    }
}

/// How many materials carry the extension; those that cannot be read are noted.
fn check_measured(scene: &Scene, path: &Path, output: &Output) -> Result<usize, Failure> {
    let (mut whole, mut broken) = (0, Vec::new());
    for (index, extension) in scene.measured() {
        match extension {
            Ok(_) => whole += 1,
            Err(error) => broken.push(format!("materials[{index}]: {error}")),
        }
    }
    // One readable material is enough for a page; without any, the first reason is the failure.
    if whole > 0 {
        broken.iter().for_each(|error| output.note(format_args!("warning: {error}")));
        return Ok(whole);
    }
    let reason = broken.into_iter().next();
    let reason = reason.unwrap_or_else(|| format!("no material carries {EXTENSION}"));
    Err(Failure::job(format!("{}: {reason}", path.display())).help(format!(
        "put measured materials into it: sgdbake export {} -o measured.glb --assign '*=gold-paint'",
        path.display()
    )))
}

/// The pieces of the scene as one .glb.
fn glb(scene: &Scene, slots: &[(SlotId, &Asset)]) -> Result<Vec<Bytes>, Failure> {
    // In a folder that is not the scene's, so that files beside it are listed.
    let export = scene.export(slots, Path::new("page/scene.glb"))?;
    let mut files = export.files.into_iter();
    let scene = files.next().map(|file| file.pieces).unwrap_or_default();
    match files.next() {
        None => Ok(scene),
        Some(beside) => Err(Failure::job(format!(
            "the scene keeps a file beside it, {}, which the page does not take in",
            beside.path.file_name().unwrap_or_default().display()
        ))
        .help("write the scene as one .glb with everything inside")),
    }
}
