//! Material files: TOML with a name and either the paper's three channels or a diffuse colour and
//! up to three lobes.
//!
//! ```toml
//! name = "my-paint"
//! [r]                  # and [g], [b]
//! rho_d = 0.14
//! rho_s = 0.16
//! alpha = 0.12
//! p = 0.79
//! f0 = 9.2e-12
//! f1 = -0.6
//! lambda = 2.65        # masking fit: all three or none
//! c = 9.3e-8
//! k = 24.4
//! ```
//!
//! ```toml
//! name = "my-coat"
//! rho_d = [0.14, 0.02, 0.02]
//! [[lobe]]             # none to three
//! alpha = 0.12
//! p = 0.79
//! rho_s = [0.16, 0.16, 0.16]
//! f0 = [0.04, 0.04, 0.04]
//! f1 = [0.0, 0.0, 0.0]
//! ```
//!
//! A table `[measured]`, in which `sgdbake measure` keeps the fit's errors, is read over.

use std::fmt::Write as _;
use std::path::Path;

use toml::de::DeTable;

use crate::material::file_error::{Located, MaterialFileError, Problem};
use crate::material::lobe::{LobeFields, LobeParams, MAX_LOBES, MaskingParams};
use crate::material::parameters::{Channel, ChannelParams, Material, MaterialError};
use crate::material::section::{MASKING, Section};

/// The largest material file that is read; a real one has under 1 KiB.
const MAX_BYTES: u64 = 1 << 20;

const REQUIRED: [&str; 6] = ["rho_d", "rho_s", "alpha", "p", "f0", "f1"];

/// Reads a material file.
///
/// # Errors
///
/// The file, the line, what was found and what is accepted.
///
/// # Example
///
/// ```no_run
/// use sgdbake::load_material;
///
/// let material = load_material("my-paint.toml".as_ref())?;
/// println!("{} has {} lobes", material.name, material.lobes().len());
/// # Ok::<(), sgdbake::material::MaterialFileError>(())
/// ```
pub fn load(path: &Path) -> Result<Material, MaterialFileError> {
    match text(path) {
        Ok(Ok(text)) => parse(&text, path),
        Ok(Err(problem)) => {
            Err(MaterialFileError::Invalid { path: path.to_owned(), line: 1, problem })
        }
        Err(source) => Err(MaterialFileError::Unreadable { path: path.to_owned(), source }),
    }
}

/// The text of a file that is not too large.
fn text(path: &Path) -> std::io::Result<Result<String, Problem>> {
    // Before it is read, as reading takes the memory of whatever file was named.
    let size = std::fs::metadata(path)?.len();
    if size > MAX_BYTES {
        return Ok(Err(Problem::TooLarge(size)));
    }
    std::fs::read_to_string(path).map(Ok)
}

/// Parses the text of a material file; `path` is what errors name.
///
/// # Errors
///
/// The line, what was found there and what is accepted.
///
/// # Example
///
/// ```
/// use sgdbake::parse_material;
///
/// let text = r#"
/// name = "my-plastic"
/// rho_d = [0.3, 0.1, 0.1]
/// [[lobe]]
/// alpha = 0.1
/// p = 0.8
/// rho_s = [0.2, 0.2, 0.2]
/// f0 = [0.04, 0.04, 0.04]
/// f1 = [0, 0, 0]
/// "#;
/// assert_eq!(parse_material(text, "my-plastic.toml".as_ref())?.name, "my-plastic");
/// # Ok::<(), sgdbake::material::MaterialFileError>(())
/// ```
pub fn parse(text: &str, path: &Path) -> Result<Material, MaterialFileError> {
    material(text).map_err(|(problem, span)| MaterialFileError::Invalid {
        path: path.to_owned(),
        line: text.as_bytes()[..span.start.min(text.len())].iter().filter(|b| **b == b'\n').count()
            + 1,
        problem,
    })
}

fn material(text: &str) -> Result<Material, Located> {
    // Editors on Windows may start a file with a byte order mark.
    let table = DeTable::parse(text.trim_start_matches('\u{feff}')).map_err(|error| {
        (Problem::Syntax(error.message().to_owned()), error.span().unwrap_or(0..0))
    })?;
    let file = Section { entries: table.get_ref(), name: String::new(), span: 0..0 };
    file.refuse_all_but(&["name", "r", "g", "b", "rho_d", "lobe", "measured"])?;
    let name = file.string("name")?;
    if name.trim().is_empty() {
        return Err((Problem::EmptyName, file.span_of("name")));
    }
    // Either key alone means the form of lobes, whose errors then name what is missing.
    if file.has("rho_d") || file.has("lobe") {
        lobe_form(name, &file)
    } else {
        paper_form(name, &file)
    }
}

/// The material of the tables `[r]`, `[g]` and `[b]`.
fn paper_form(name: String, file: &Section<'_>) -> Result<Material, Located> {
    let [r, g, b] = Channel::ALL.map(|channel| channel_params(&file.section(channel.name())?));
    let channels = [r?, g?, b?];
    Material::of_channels(name, &channels).map_err(|error| file.out_of_range(error))
}

/// The material of `rho_d` and the `[[lobe]]` tables.
fn lobe_form(name: String, file: &Section<'_>) -> Result<Material, Located> {
    if let Some(channel) = Channel::ALL.into_iter().find(|channel| file.has(channel.name())) {
        let key = channel.name();
        return Err((Problem::BothForms(key.to_owned()), file.span_of(key)));
    }
    let lobes = file.sections("lobe")?;
    if lobes.len() > MAX_LOBES {
        return Err((Problem::TooManyLobes(lobes.len()), lobes[MAX_LOBES].span.clone()));
    }
    let lobes = lobes.iter().map(lobe_params).collect::<Result<_, _>>()?;
    Material::new(name, file.colour("rho_d")?, lobes).map_err(|error| match error {
        MaterialError::Parameter(error) => file.out_of_range(error),
        MaterialError::Lobes(found) => (Problem::TooManyLobes(found), 0..0),
    })
}

fn channel_params(section: &Section<'_>) -> Result<ChannelParams, Located> {
    section.refuse_all_but(&[&REQUIRED[..], &MASKING].concat())?;
    let params = ChannelParams {
        masking: section.masking()?,
        rho_d: section.number("rho_d")?,
        rho_s: section.number("rho_s")?,
        alpha: section.number("alpha")?,
        p: section.number("p")?,
        f0: section.number("f0")?,
        f1: section.number("f1")?,
    };
    // Here, where the table is known; `of_channels` would not tell which channel it is.
    params.validate().map_err(|error| section.out_of_range(error))?;
    Ok(params)
}

fn lobe_params(section: &Section<'_>) -> Result<LobeParams, Located> {
    section.refuse_all_but(&[&REQUIRED[1..], &MASKING].concat())?;
    let fields = LobeFields {
        masking: section.masking()?,
        alpha: section.number("alpha")?,
        p: section.number("p")?,
        rho_s: section.colour("rho_s")?,
        f0: section.colour("f0")?,
        f1: section.colour("f1")?,
    };
    LobeParams::new(fields).map_err(|error| section.out_of_range(error))
}

/// The text of a material file that reads back as the same material.
#[must_use]
pub fn to_toml(material: &Material) -> String {
    let mut text = format!("name = {}\n", toml::Value::from(material.name.as_str()));
    // `{:?}` writes the shortest digits that read back as the same number.
    let _ = writeln!(text, "rho_d = {:?}", material.rho_d());
    for lobe in material.lobes() {
        let _ = writeln!(text, "\n[[lobe]]\nalpha = {:?}\np = {:?}", lobe.alpha(), lobe.p());
        for (key, colour) in [("rho_s", lobe.rho_s()), ("f0", lobe.f0()), ("f1", lobe.f1())] {
            let _ = writeln!(text, "{key} = {colour:?}");
        }
        if let Some(MaskingParams { lambda, c, k }) = lobe.masking() {
            let _ = writeln!(text, "lambda = {lambda:?}\nc = {c:?}\nk = {k:?}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHANNELS: &str = "
[r]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 9.2e-12
f1 = -0.6
[g]
rho_d = 0
rho_s = 1
alpha = 0.1
p = 0
f0 = 0.1
f1 = 0
lambda = 2.65
c = 9.3e-8
k = 24.4
[b]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 9.2e-12
f1 = -0.6
";

    fn text() -> String {
        format!("name = \"my-paint\"{CHANNELS}")
    }

    fn refusal(text: &str) -> String {
        parse(text, Path::new("m.toml")).expect_err("must be refused").to_string()
    }

    #[test]
    fn a_full_file_parses() {
        let material = parse(&text(), Path::new("m.toml")).expect("valid");
        assert_eq!(material.name, "my-paint");
        let channels = material.channels().expect("in the paper's form");
        assert_eq!(channels[0].masking, None);
        assert_eq!(channels[1].masking.expect("given").k, 24.4);
        assert_eq!(material.lobes().len(), 2, "r and b have one shape");
    }

    #[test]
    fn a_byte_order_mark_is_read_over() {
        parse(&format!("\u{feff}{}", text()), Path::new("m.toml")).expect("valid");
    }

    #[test]
    fn lobes_are_written_and_read_back_equal() {
        let text = "name = \"coat\"\nrho_d = [0.1, 2e-3, 0]\n[[lobe]]\nalpha = 0.1\np = 0.5\n\
                    rho_s = [1, 2, 3]\nf0 = [0.1, 0.2, 1e-12]\nf1 = [0, -0.1, 0]\n[[lobe]]\n\
                    alpha = 1e-5\np = 0\nrho_s = [1, 1, 1]\nf0 = [0.04, 0.04, 0.04]\nf1 = [0, 0, 0]\n\
                    lambda = 2.5\nc = 1e-8\nk = 20\n[measured]\ndelta_e = 1.0\n";
        let material = parse(text, Path::new("m.toml")).expect("valid");
        assert_eq!(material.lobes().len(), 2);
        let back = parse(&to_toml(&material), Path::new("m.toml")).expect("valid");
        assert_eq!(back, material);
    }

    fn file(body: &str) -> String {
        format!("name = \"m\"\nrho_d = [0, 0, 0]\n{body}")
    }

    #[test]
    fn the_lobe_form_is_refused_where_it_is_wrong() {
        let lobe =
            "[[lobe]]\nalpha = 0.1\np = 0.5\nrho_s = [1, 2, 3]\nf0 = [0, 0, 0]\nf1 = [0, 0, 0]\n";
        let cases = [
            (file(&lobe.repeat(4)), "m.toml:21: found 4 [[lobe]] tables"),
            (file(&lobe.replace("p = 0.5\n", "")), "m.toml:3: `lobe 1.p` is missing"),
            (
                file(&lobe.replace("[1, 2, 3]", "[1, 2]")),
                "m.toml:6: `lobe 1.rho_s` is of type array",
            ),
            (file(&lobe.replace("0.1", "-1")), "m.toml:4: lobe 1.alpha = -1 is out of range"),
            (file("[r]\nrho_d = 1"), "m.toml:3: found `r` together with rho_d"),
        ];
        for (text, expected) in cases {
            let message = refusal(&text);
            assert!(message.starts_with(expected), "{message}");
        }
    }

    #[test]
    fn refusals_name_file_line_key_and_range() {
        let cases = [
            (
                "alpha = 0.1\n",
                "alpha = 0\n",
                "m.toml:12: g.alpha = 0 is out of range; it must be between 1e-8 and 100",
            ),
            ("rho_s = 1\n", "rho_s = 1e308\n", "m.toml:11: g.rho_s = 1e308 is out of range"),
            ("rho_s = 1\n", "rho_s = 0xffff\n", "m.toml:11: g.rho_s = 65535 is out of range"),
            ("rho_s = 1\n", "rho_s = nan\n", "m.toml:11: g.rho_s = NaN is out of range"),
            ("rho_s = 1\n", "rho_s = -inf\n", "m.toml:11: g.rho_s = -inf is out of range"),
            ("p = 0\n", "p = -1\n", "m.toml:13: g.p = -1 is out of range"),
            ("k = 24.4\n", "", "m.toml:9: `g.k` is missing"),
            (
                "k = 24.4\n",
                "k = \"x\"\n",
                "m.toml:18: `g.k` is of type string; it must be a number",
            ),
            ("k = 24.4\n", "kk = 1\nk = 24.4\n", "m.toml:18: unknown key `g.kk`"),
            (
                "name = \"my-paint\"",
                "name = 3",
                "m.toml:1: `name` is of type integer; it must be a string",
            ),
            ("name = \"my-paint\"", "name = \"", "m.toml:1: not valid TOML"),
            ("[b]", "[bb]", "unknown key `bb`"),
        ];
        for (from, to, expected) in cases {
            let message = refusal(&text().replacen(from, to, 1));
            assert!(message.starts_with(expected) || message.contains(expected), "{message}");
        }
    }
}
