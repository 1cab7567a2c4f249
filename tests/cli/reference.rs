//! The reference in `docs/cli.md` is what the definition of the command line says. `UPDATE_DOCS=1` writes it.

use std::fs;

use clap::{Arg, ArgAction, Command};
use relightable_photo::cli;

const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/cli.md");
/// The reference is the last part of the document.
const BEGIN: &str = "<!-- Written by UPDATE_DOCS=1 cargo test --test cli reference. -->\n";

#[test]
fn the_reference_agrees_with_the_definition() {
    let document = fs::read_to_string(DOCUMENT).unwrap();
    let (prose, written) = document.split_once(BEGIN).unwrap();
    let reference = reference(&cli::definition());
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(DOCUMENT, format!("{prose}{BEGIN}{reference}")).unwrap();
        return;
    }
    assert!(
        written == reference,
        "docs/cli.md is out of date; run: UPDATE_DOCS=1 cargo test --test cli reference"
    );
}

/// Every subcommand with its arguments, in Markdown.
fn reference(program: &Command) -> String {
    let commands = program.get_subcommands();
    commands.flat_map(|command| sections("", command)).collect()
}

/// The section of a command, or those of its own subcommands; `parent` is what precedes its name.
fn sections(parent: &str, command: &Command) -> Vec<String> {
    let name = format!("{parent}{}", command.get_name());
    if !command.has_subcommands() {
        return vec![section(&name, command)];
    }
    let about = sentence(&command.get_about().unwrap_or_default().to_string());
    let parent = format!("{name} ");
    let of_subcommands = command.get_subcommands();
    let of_subcommands = of_subcommands.flat_map(|command| sections(&parent, command));
    std::iter::once(format!("\n### {name}\n\n{about}\n"))
        .chain(of_subcommands)
        .collect()
}

fn section(name: &str, command: &Command) -> String {
    let (positional, options): (Vec<&Arg>, Vec<&Arg>) = command
        .get_arguments()
        .filter(|argument| !argument.is_hide_set())
        .partition(|argument| argument.is_positional());
    let usage = usage(name, &positional, &options);
    let about = sentence(&command.get_about().unwrap_or_default().to_string());
    let rows: String = positional.into_iter().chain(options).map(row).collect();
    format!("\n### {name}\n\n{about}\n\n```sh\n{usage}\n```\n\n| argument | |\n|---|---|\n{rows}")
}

/// The required arguments; the others are options.
fn usage(name: &str, positional: &[&Arg], options: &[&Arg]) -> String {
    let mut words = vec![format!("ltm-export {name}")];
    words.extend(
        positional
            .iter()
            .map(|argument| match argument.is_required_set() {
                true => value_names(argument),
                false => format!("[{}]", value_names(argument)),
            }),
    );
    let required = options.iter().filter(|argument| argument.is_required_set());
    words.extend(required.map(|argument| match argument.get_short() {
        Some(short) => format!("-{short} {}", value_names(argument)),
        None => flag(argument),
    }));
    if options.iter().any(|argument| !argument.is_required_set()) {
        words.push("[options]".to_owned());
    }
    words.join(" ")
}

fn row(argument: &Arg) -> String {
    let mut text = sentence(&argument.get_help().unwrap_or_default().to_string());
    let values: Vec<String> = match argument.get_action() {
        ArgAction::SetTrue => Vec::new(),
        _ => argument
            .get_possible_values()
            .iter()
            .map(possible_value)
            .collect(),
    };
    if !values.is_empty() {
        text += &format!("<br>{}", values.join("<br>"));
    }
    let defaults: Vec<String> = argument
        .get_default_values()
        .iter()
        .map(|value| format!("`{}`", value.to_string_lossy()))
        .collect();
    if !defaults.is_empty() && !argument.is_hide_default_value_set() && takes_value(argument) {
        text += &format!("<br>Default: {}", defaults.join(" "));
    }
    let name = match argument.is_positional() {
        true => value_names(argument),
        false => flag(argument),
    };
    format!(
        "| `{}` | {} |\n",
        name.replace('|', "\\|"),
        text.replace('|', "\\|")
    )
}

fn possible_value(value: &clap::builder::PossibleValue) -> String {
    let name = value.get_name();
    value
        .get_help()
        .map_or_else(|| format!("`{name}`"), |help| format!("`{name}`: {help}"))
}

fn flag(argument: &Arg) -> String {
    let long = argument.get_long().map(|long| format!("--{long}"));
    let short = argument.get_short().map(|short| format!("-{short}"));
    let names: Vec<String> = short.into_iter().chain(long).collect();
    let names = names.join(", ");
    match takes_value(argument) {
        true => format!("{names} {}", value_names(argument)),
        false => names,
    }
}

fn takes_value(argument: &Arg) -> bool {
    argument.get_action().takes_values()
}

fn value_names(argument: &Arg) -> String {
    let names = argument.get_value_names().unwrap_or_default();
    let names: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
    let many = match argument.get_action() {
        ArgAction::Append => "…",
        _ => "",
    };
    match names.is_empty() {
        true => argument.get_id().as_str().to_uppercase(),
        false => names.join(" ") + many,
    }
}

/// Help text as a sentence, without clap's mark of a default that it cannot know.
fn sentence(help: &str) -> String {
    let text = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let text = text.replace('<', "&lt;");
    match text
        .strip_suffix(']')
        .and_then(|text| text.split_once(" [default: "))
    {
        Some((text, default)) => format!("{text}<br>Default: {default}"),
        None => text,
    }
}
