//! The pages that the program prints are those under docs/.

use std::process::Command;

fn help(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_sgdbake"))
        .args(arguments)
        .arg("--help")
        .output()
        .expect("the binary runs");
    String::from_utf8(output.stdout).expect("help is text").trim_end().to_owned()
}

/// The names under `Commands:`, clap's own `help` left out.
fn commands(help: &str) -> Vec<&str> {
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    listed
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect()
}

#[test]
fn docs_cli_is_what_help_prints() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/cli.md");
    let page = std::fs::read_to_string(path).expect("docs/cli.md is there");
    let root = help(&[]);
    assert!(page.contains(&format!("$ sgdbake --help\n{root}\n")), "run scripts/docs.sh");
    let commands = commands(&root);
    assert!(commands.len() > 10, "{commands:?}");
    for command in &commands {
        let text = format!("$ sgdbake {command} --help\n{}\n", help(&[command]));
        assert!(page.contains(&text), "{command} differs: run scripts/docs.sh");
        assert!(text.contains("Example"), "the help of {command} has no example");
    }
    assert_eq!(page.matches("\n## ").count(), commands.len(), "a section for each command");
}
