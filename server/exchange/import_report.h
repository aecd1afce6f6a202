// What an import made of a file, each by name: taken, defaulted, guessed, left out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gonio::exchange {

enum class Outcome : std::uint8_t {
    taken,
    defaulted,  // the file does not say it, or says what cannot be: the standard's default was taken
    guessed,    // the file can be read in more than one way
    left_out,
};

// All notes that say the same.
struct ImportNote {
    Outcome outcome = Outcome::taken;
    std::string what;                  // "the model file is not in the archive"
    std::size_t count = 0, named = 0;  // how many there are; how many have a name
    std::vector<std::string> names{};  // of what it happened to: the first kNamesOfLine
};

inline constexpr std::size_t kMaxNotes = 1'000;        // different ones of a report; notes of further ones are counted
inline constexpr std::size_t kMaxNoteNameBytes = 128;  // names are shortened_text()
inline constexpr std::size_t kNamesOfLine = 8;         // that are kept, and that a line of report_lines() shows

struct ImportReport {
    std::vector<ImportNote> notes;                                    // in the order of the first of each
    std::size_t unlisted = 0;                                         // notes of what is beyond kMaxNotes
    std::map<std::pair<Outcome, std::string>, std::size_t> places{};  // of notes

    void add(Outcome outcome, std::string what, std::string_view name = {});
    // Adds the other report's notes. prefix: goes before each of their names, with ": ".
    void add(const ImportReport& other, const std::string& prefix = {});
    // Result: how many notes say so; `what` empty: of this outcome.
    std::size_t count(Outcome outcome, std::string_view what = {}) const;
};

// Result: a line for each `what` that was not taken: "left out: the model file is not in the archive: "a.3ds", "b.3ds"
// and 12 more". Outcomes are in the order of their enum, lines of one in that of their first notes.
std::vector<std::string> report_lines(const ImportReport& report);
// Result: the same of what was taken.
std::vector<std::string> taken_lines(const ImportReport& report);

}  // namespace gonio::exchange
