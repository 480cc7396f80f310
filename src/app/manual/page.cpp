// SPDX-License-Identifier: MIT
// The man pages firn(1) and firn-scene(5), in roff with the macros of man(7).
#include "firn/version.h"
#include "src/app/exit_code.h"
#include "src/app/manual/manual.h"
#include "src/scene/schema.h"

namespace firn {
namespace {

// A dot or a quote at the beginning of a line would be an order to roff, a plain "-" a hyphen.
std::string roff(std::string text) {
  text = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  text = replaced(replaced(text, "\n.", "\n\\&."), "\n'", "\n\\&'");
  return (!text.empty() && (text[0] == '.' || text[0] == '\'') ? "\\&" : "") + text;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

std::string heading(const std::string& name, int section) {
  return ".TH " + name + " " + std::to_string(section) + " \"\" \"firn " + version() + "\" \"" +
         (section == 1 ? "User Commands" : "File Formats") + "\"\n";
}

std::string item(const std::string& term, const std::string& meaning) {
  return ".TP\n" + term + "\n" + meaning + "\n";
}

std::string option_item(const OptionWords& option) {
  std::string term;
  for (const std::string& name : spellings(option)) term += (term.empty() ? "" : ", ") + bold(name);
  if (!option.value.empty()) term += " " + italic(option.value);
  return item(term, roff(option.meaning) + ".");
}

std::string usage(const CommandWords& command) {
  std::string text = bold("firn " + command.name);
  for (const OptionWords& operand : command.operands) {
    text += operand.required ? " " + italic(operand.name) : " [" + italic(operand.name) + "]";
  }
  return text + " [" + italic("OPTION") + "]...";
}

std::string synopsis(const CommandLine& words) {
  std::string text = ".SH SYNOPSIS\n.nf\n";
  for (const CommandWords& command : words.commands) text += usage(command) + "\n";
  text += bold("firn help") + " [" + italic("COMMAND") + "]\n";
  for (const OptionWords& option : words.program.options) text += bold("firn " + option.name) + "\n";
  return text + ".fi\n";
}

std::string command_section(const CommandWords& command) {
  std::string text = ".SS " + usage(command) + "\n" + roff(command.meaning) + ".\n";
  for (const OptionWords& operand : command.operands)
    text += item(italic(operand.name), roff(operand.meaning) + ".");
  for (const OptionWords& option : command.options) text += option_item(option);
  return text;
}

const char* const kDescription =
    R"(firn simulates snow as an elastoplastic material and path traces the same particles, frame by frame, on CPUs. A scene is
a TOML file (see firn-scene(5)). A run lands in a folder of its own, out/SCENE unless --out says otherwise: the pictures in
frames/, movie.mp4 or, where there is no ffmpeg(1), movie.webp, the manifest run.json, frames.jsonl with times and hashes of
each frame, metrics.csv, log.txt and trace.json. Nothing is overwritten silently. The same scene and seed give the same bits
for any number of threads.)";

std::string exit_status() {
  const std::pair<ExitCode, const char*> codes[] = {
      {ExitCode::ok, "All went well."},
      {ExitCode::failed, "Something failed that is none of the following."},
      {ExitCode::usage, "The command line or the scene has a mistake."},
      {ExitCode::unstable, "The simulation became unstable."},
      {ExitCode::io, "A file could not be read or written."},
      {ExitCode::interrupted, "The run was interrupted; firn resume goes on with it."},
  };
  std::string text = ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : codes)
    text += item(bold(std::to_string(static_cast<int>(code))), roff(meaning));
  return text;
}

std::string example(const std::string& command, const std::string& meaning) {
  return item(bold(command), roff(meaning));
}

std::string examples(const std::string& scenes) {
  const std::string scene = scenes + "/two_snowballs.toml";
  return ".SH EXAMPLES\n.ad l\n" +
         example("firn run " + scene + " --quick", "Makes the small size of a scene.") +
         example("firn run " + scene + " --set snow.young_modulus=3e5 --set image.samples=64",
                 "Changes two keys of a scene.") +
         example("firn render out/two_snowballs --frames 20-30",
                 "Makes pictures of the particles that a run kept.") +
         example("firn resume out/two_snowballs", "Goes on with an interrupted run, to the same bits.") +
         example("firn params snow", "Prints the keys of snow.") + ".ad b\n";
}

std::string key_item(const KeySpec& key, const TableSpec& table) {
  std::string meaning = roff(type_text(key));
  if (*key.notes.unit != 0) meaning += " [" + roff(key.notes.unit) + "]";
  meaning += "; default: " + roff(default_text(table, key));
  if (!key.notes.range.everything()) meaning += "; range: " + roff(key.notes.range.text());
  if (!key.notes.with.key.empty())
    meaning += "; for " + roff(key.notes.with.key + " = " + joined(key.notes.with.values, ", "));
  return item(bold(key.name), meaning + ".\n.br\n" + roff(key.notes.meaning) + ".");
}

const char* const kSceneDescription =
    R"(A scene is a TOML file. Units are SI, the world is right-handed with +Y up, colours are linear RGB: one number or three.
Paths are relative to the scene. A table in double brackets may stand any number of times. The table [quick] holds other values
for keys of the scene, which --quick chooses: [quick.image], say. The option --set of firn(1) takes TABLE.KEY=VALUE, and
TABLE.NAME.KEY=VALUE for the one record of that name.)";

}  // namespace

std::string program_page(const CommandLine& words, const InstalledFolders& folders) {
  std::string text = heading("FIRN", 1) + ".SH NAME\nfirn \\- snow, simulated and path traced on CPUs\n" +
                     synopsis(words) + ".SH DESCRIPTION\n" + roff(kDescription) + "\n.SH OPTIONS\n";
  for (const OptionWords& option : words.program.options) text += option_item(option);
  text += ".SH COMMANDS\n";
  for (const CommandWords& command : words.commands) text += command_section(command);
  text +=
      exit_status() + examples(folders.scenes) + ".SH FILES\n" +
      item(italic(folders.scenes), "Scenes to begin with, each with a small size of its own (\\-\\-quick).") +
      item(italic(folders.pages), "The documents: what a run keeps, the equations, the library.");
  return text + ".SH SEE ALSO\n.BR firn\\-scene (5),\n.BR ffmpeg (1)\n";
}

std::string scene_page() {
  std::string text = heading("FIRN\\-SCENE", 5) +
                     ".SH NAME\nfirn\\-scene \\- scenes of firn\n.SH DESCRIPTION\n" +
                     roff(kSceneDescription) + "\n";
  for (const TableSpec& table : schema()) {
    text += ".SH " + (table.name.empty() ? std::string("TOP LEVEL") : roff(table.heading())) + "\n" +
            roff(table.meaning) + ".\n";
    for (const KeySpec& key : table.keys) text += key_item(key, table);
  }
  return text + ".SH SEE ALSO\n.BR firn (1)\n";
}

}  // namespace firn
