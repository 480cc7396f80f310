// SPDX-License-Identifier: MIT
// The only file that knows CLI11 (it takes seconds to compile).
#include "src/app/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <limits>

#include "firn/error.h"
#include "src/app/command_line.h"
#include "src/io/program.h"
#include "src/io/version.h"
#include "src/scene/suggest.h"

namespace firn {
namespace {

constexpr const char* kSeeHelp = " (see 'firn --help')";

// What is typed, before it is checked for sense.
struct Typed {
  Options options;
  std::vector<std::string> set;
  std::optional<std::string> frames;
  std::optional<std::string> seed;
  bool no_overlap = false;
};

void add_scene_options(CLI::App& app, Typed& typed) {
  app.add_option("--set", typed.set,
                 "Change a scene key, e.g. --set image.width=320 (repeatable; see 'firn params')")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
  app.add_flag("--quick", typed.options.quick, "The small size that the scene defines in its [quick] table");
  app.add_option("--seed", typed.seed, "Same as --set simulation.seed=N")->type_name("N");
  app.add_flag("--force", typed.options.session.force, "Accept a fixed dt above the stable bound");
}

void add_machine_options(CLI::App& app, Typed& typed) {
  app.add_option("--threads", typed.options.session.threads, "Threads to use (default: all)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app.add_option("--isa", typed.options.session.isa,
                 "Instruction set of the kernels (default: auto, the best)")
      ->type_name("auto|base|x86-64-v3|x86-64-v4");
}

void add_run_options(CLI::App& app, Typed& typed) {
  add_machine_options(app, typed);
  app.add_flag("--quiet", typed.options.quiet, "Say nothing but errors");
  app.add_flag("--no-overlap", typed.no_overlap, "Simulate, trace and write one after another");
}

void add_output_options(CLI::App& app, Typed& typed) {
  app.add_option("--out", typed.options.session.out, "Output folder (default: the next free out/<scene>)")
      ->type_name("DIR");
  app.add_flag("--overwrite", typed.options.session.overwrite,
               "Replace the run that the output folder holds");
  app.add_option("--frames", typed.frames,
                 "Only these frames, both ends included; frame 0 is the initial state")
      ->type_name("A-B");
}

CLI::App* add_command(CLI::App& app, Typed& typed, const char* name, const char* meaning) {
  CLI::App* command = app.add_subcommand(name, meaning);
  command->callback([&typed, name] { typed.options.command = name; });
  return command;
}

void add_target(CLI::App* command, Typed& typed, const char* what, const char* meaning) {
  command->add_option(what, typed.options.target, meaning)->required();
}

void add_commands(CLI::App& app, Typed& typed) {
  auto* run = add_command(app, typed, "run", "Simulate, render and make the movie");
  add_target(run, typed, "SCENE", "Scene file (TOML)");
  auto* simulate =
      add_command(app, typed, "simulate", "Simulate only; keeps every frame's particles for 'firn render'");
  add_target(simulate, typed, "SCENE", "Scene file (TOML)");
  auto* render = add_command(app, typed, "render",
                             "Render a run's kept particles, or frames of a scene (default: frame 0)");
  add_target(render, typed, "RUN|SCENE", "Run folder or scene file");
  for (auto* command : {run, simulate, render}) {
    add_scene_options(*command, typed);
    add_output_options(*command, typed);
    add_run_options(*command, typed);
  }
  auto* resume =
      add_command(app, typed, "resume", "Continue an interrupted run; its finished frames are kept");
  add_target(resume, typed, "RUN", "Run folder");
  add_run_options(*resume, typed);
  auto* check = add_command(app, typed, "check",
                            "Validate a scene; print particles, memory, grid, dt and what limits it");
  add_target(check, typed, "SCENE", "Scene file (TOML)");
  add_scene_options(*check, typed);
  add_machine_options(*check, typed);
  auto* params =
      add_command(app, typed, "params", "Print every scene key: type, unit, default, range, meaning");
  params->add_option(
      "WORD", typed.options.target,
      "Only keys that begin so, e.g. snow or image.width, or else that have it in their meaning");
  params->add_flag("--markdown", typed.options.markdown, "Print the page docs/scene_format.md instead");
  auto* info =
      add_command(app, typed, "info",
                  "Print version, compiler, CPU, instruction sets and features; of a RUN what it did");
  CLI::Option* run_folder = info->add_option("RUN", typed.options.target, "Run folder");
  info->add_flag("--json", typed.options.json, "The manifest of the RUN and its frames, as JSON")
      ->needs(run_folder);
}

void add_everything(CLI::App& app, Typed& typed) {
  app.description(
      "firn: snow, simulated and path traced on CPUs. One command from a scene file to a movie:\n"
      "  firn run scenes/two_snowballs.toml --quick\n");
  app.set_version_flag("--version", "firn " + version() + " (" + revision() + ")");
  app.require_subcommand(1);
  add_commands(app, typed);
}

// CLI11 adds to the name of a value what it checks: "N:INT in [1 - 1024]".
OptionWords words_of(const CLI::Option& option) {
  OptionWords words;
  if (option.get_positional()) words.name = option.get_name(true);
  for (const std::string& name : option.get_lnames()) words.name = "--" + name;
  for (const std::string& name : option.get_snames()) words.short_name = "-" + name;
  const std::string type = option.get_type_name();
  if (option.get_items_expected_max() > 0) words.value = type.substr(0, type.find(':'));
  words.meaning = option.get_description();
  words.required = option.get_required();
  words.repeatable = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  return words;
}

CommandWords words_of(const CLI::App& app) {
  CommandWords words{app.get_name(), app.get_description(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? words.operands : words.options).push_back(words_of(*option));
  }
  return words;
}

SceneOverride parse_override(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error(ErrorCode::usage, "--set", "'" + text + "' is not of the form key=value");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::optional<int> parse_frame(const std::string& text) {
  const bool digits =
      !text.empty() && text.size() < 8 && text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? std::optional(std::stoi(text)) : std::nullopt;
}

std::pair<int, int> parse_frames(const std::string& text) {
  const auto dash = text.find('-');
  const auto first = parse_frame(text.substr(0, dash));
  const auto last = dash == std::string::npos ? first : parse_frame(text.substr(dash + 1));
  if (!first || !last) {
    throw Error(ErrorCode::usage, "--frames", "'" + text + "' is not a range of frames such as 0-23 or 12");
  }
  if (*first > *last) {
    throw Error(ErrorCode::usage, "--frames",
                "'" + text + "' runs backwards, did you mean " + std::to_string(*last) + "-" +
                    std::to_string(*first) + "?");
  }
  return {*first, *last};
}

std::string parse_seed(const std::string& text) {
  std::int64_t seed = -1;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, seed);
  if (read.ec != std::errc() || read.ptr != end || seed < 0) {
    throw Error(ErrorCode::usage, "--seed",
                "'" + text + "' is not a whole number from 0 to " +
                    std::to_string(std::numeric_limits<std::int64_t>::max()));
  }
  return std::to_string(seed);
}

Options checked(Typed& typed) {
  Options options = typed.options;
  for (const auto& text : typed.set) options.overrides.push_back(parse_override(text));
  if (typed.seed) options.overrides.push_back({"simulation.seed", parse_seed(*typed.seed)});
  if (typed.frames) options.session.frames = parse_frames(*typed.frames);
  if (options.session.out && options.session.out->empty())
    throw Error(ErrorCode::usage, "--out", "the name of the folder is empty");
  options.session.overlap = !typed.no_overlap;
  return options;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// Before the command.
std::string unknown_option(const std::string& word, const CLI::App& app) {
  const std::string name = word.substr(0, word.find('='));
  std::vector<std::string> names = option_names(app);
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_option_no_throw(name))
      return "'" + word + "' stands before the command; write 'firn COMMAND " + word + "'";
    for (const std::string& other : option_names(*command)) names.push_back(other);
  }
  return "there is no option '" + name + "'" + suggestion(name, names) + kSeeHelp;
}

// What was meant by a first word that is no command.
std::string unknown_command(const std::string& word, const CLI::App& app) {
  std::error_code ignored;
  if (word.size() > 1 && word[0] == '-') return unknown_option(word, app);
  if (std::filesystem::exists(word + "/run.json", ignored))
    return "'" + word + "' is a run, not a command, did you mean 'firn resume " + word + "'?";
  if (word == "-" || std::filesystem::path(word).extension() == ".toml" ||
      std::filesystem::is_regular_file(word, ignored))
    return "'" + word + "' is a scene, not a command, did you mean 'firn run " + word + "'?";
  const std::vector<std::string> names = command_names(app);
  const std::string meant = suggestion(word, names);
  return "unknown command '" + word + "'" + (meant.empty() ? "; there are: " + list_of(names) : meant) +
         kSeeHelp;
}

// Words that a command does not take; behind "--" none is an option.
std::string unexpected(const CLI::App& command, const std::string& word, bool operand) {
  const std::string title = "'firn " + command.get_name() + "'";
  if (operand || word.size() < 2 || word[0] != '-')
    return title + " does not take '" + word + "' too" + kSeeHelp;
  const std::string name = word.substr(0, word.find('='));
  return title + " has no option '" + name + "'" + suggestion(name, option_names(command)) + kSeeHelp;
}

// A script's variable that is not set, say.
void refuse_empty_operands(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      const auto& words = option->results();
      if (option->get_positional() && std::find(words.begin(), words.end(), "") != words.end())
        throw Error(
            ErrorCode::usage, "",
            "'firn " + command->get_name() + "': " + option->get_name() + " is an empty word" + kSeeHelp);
    }
  }
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  for (const CLI::App* command : app.get_subcommands()) {
    const std::vector<std::string> extras = command->remaining();
    const auto word = std::find_if(extras.begin(), extras.end(), [](const auto& w) { return w != "--"; });
    if (word != extras.end()) return unexpected(*command, *word, word != extras.begin());
    return "'firn " + command->get_name() + "': " + error.what() + kSeeHelp;
  }
  return error.what() + std::string(kSeeHelp);
}

// "firn help run" is "firn run --help".
std::vector<std::string> without_help_command(const std::vector<std::string>& words) {
  if (words.empty() || words.front() != "help") return words;
  if (words.size() == 1) return {"--help"};
  return {words[1], "--help"};
}

}  // namespace

CommandLine command_line() {
  Typed typed;
  CLI::App app("", "firn");
  add_everything(app, typed);
  CommandLine all{words_of(app), {}};
  for (const CLI::App* command : app.get_subcommands({})) all.commands.push_back(words_of(*command));
  return all;
}

std::optional<Options> parse_options(int count, const char* const* arguments) {
  Typed typed;
  CLI::App app("", "firn");
  add_everything(app, typed);
  const std::vector<std::string> words =
      without_help_command({arguments + std::min(count, 1), arguments + count});
  if (words.empty()) {
    std::cerr << app.help();
    throw Error(ErrorCode::usage, "", "no command given");
  }
  std::vector<std::string> known = command_names(app);
  known.insert(known.end(), {"-h", "--help", "--version"});
  if (std::count(known.begin(), known.end(), words.front()) == 0)
    throw Error(ErrorCode::usage, "", unknown_command(words.front(), app));
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::Success& success) {  // --help and --version
    app.exit(success, std::cout, std::cerr);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw Error(ErrorCode::usage, "", explain(app, error));
  }
  refuse_empty_operands(app);
  Options options = checked(typed);
  options.session.command = shell_line({arguments, arguments + count});
  return options;
}

}  // namespace firn
