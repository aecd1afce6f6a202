// The table of commands and options that the words of a command line are read by: parsing, help and the sentences of
// refusals all come from its rows.
//
// CLI11 reads goniod's options; here it does not fit. It throws text where a refusal names the option and the word. It
// also changes names: of `group wash a get` it drops the light "get", of "[x]" the brackets (version 2.1).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"
#include "protocol/schema/gonio.pb.h"

namespace gonio {

// How a value is written. A number may also be nan or inf: the server decides what it accepts.
enum class WordForm : std::uint8_t {
    flag,  // no value
    text,
    names,  // a,b,c
    number,
    ratio,           // a number or a percentage: 0.5 is 50%
    degrees,         // a number; radians in the message
    count,           // a whole number
    positive_count,  // a whole number above 0
    whole,           // a whole number, below 0 too
    edge_samples,    // a whole number from 1 to 64
    vector,          // 1,2,3; how many there must be is the server's business
    color,           // 1,0.5,0, linear; or a colour of CSS; or #rrggbb
    vector_or_auto,  // as vector; or auto: none
    size,            // 800x600, both above 0: into a field and the next one, or into a repeated one
    seconds,         // a number or a fraction: 1/60
    on_or_off,       // true or false
    number_or_auto,  // a number; or auto: true in the next field
    range,           // 0:1000 into a field and the next one; or auto: true in the one after them
    picture,         // the name of a file; in the message its format: "png", "jpg" or "exr"
    scene_file,      // likewise "glb" or "mvr"
};

// An option, or a word that is none.
struct WordRow {
    std::string_view name;  // "--level"; or "NAME", "[PATH]" that may be absent, "FILE…" for one or more, "[LIGHT…]"
    std::string_view metavar;  // what help calls an option's value
    WordForm form = WordForm::text;
    std::string_view field;  // of the command's message, where the value goes; empty: nowhere
    std::string_view help;   // unit, range, default
};

struct WordCommand {
    std::string_view name;     // "set light"
    std::string_view message;  // path in ClientMessage of what it fills; empty: its caller makes the message
    std::string_view help;     // a sentence
    std::span<const WordRow> names;
    std::span<const WordRow> options;
    std::string_view needs[2] = {};  // options that must be there
};

struct Grammar {
    std::span<const WordCommand> table;
    std::span<const WordRow> common = {};  // options of every command
    std::string_view implied = {};         // the first word of a command of two that may be absent; empty: none may
};

struct ReadWords {
    const WordCommand* command = nullptr;  // none: help or a fault
    std::string group;                     // the first word of a command of two: "set"
    std::vector<std::string> names;        // the words that are no options, in order, without the command's own
    std::map<std::string_view, std::string> options;  // as written, by the name of their row; the last of each
    v1::ClientMessage message;                        // of the command
    std::optional<Error> fault;                       // "usage", with the option as place and the word as value
    bool has(std::string_view option) const { return options.contains(option); }
};

// Result: what the words say. Options are "--name value" or "--name=value"; a negative number is a word, not an option;
// after "--" everything is a word. Of several faults the first is told, and the rest is read all the same, so that
// --json and --help count wherever they stand.
ReadWords read_words(std::span<const std::string> words, const Grammar& grammar);

// Result: the options of every command that changes the scene: --base-rev.
std::span<const WordRow> change_options();

}  // namespace gonio
