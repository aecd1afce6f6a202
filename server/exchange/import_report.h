// What an import made of a file, each by name: taken, defaulted, guessed, left out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gonio::exchange {

enum class Outcome : std::uint8_t {
    taken,
    defaulted,  // the file does not say it, or says what cannot be: the standard's default was taken
    guessed,    // the file can be read in more than one way
    left_out,
};

struct ImportNote {
    Outcome outcome = Outcome::taken;
    std::string what;  // "the model file is not in the archive"
    std::string name;  // of what it happened to; may be empty
    bool operator==(const ImportNote&) const = default;
};

inline constexpr std::size_t kMaxNotes = 20'000;       // of a report; what is more is counted
inline constexpr std::size_t kMaxNoteNameBytes = 128;  // names are shortened_text()
inline constexpr std::size_t kNamesOfLine = 8;         // that a line of report_lines() shows

struct ImportReport {
    std::vector<ImportNote> notes;
    std::size_t unlisted = 0;  // notes beyond kMaxNotes

    void add(Outcome outcome, std::string what, std::string_view name = {});
    // Adds the other report's notes. prefix: goes before each of their names, with ": ".
    void add(const ImportReport& other, const std::string& prefix = {});
    // Result: how many notes say so; `what` empty: of this outcome.
    std::size_t count(Outcome outcome, std::string_view what = {}) const;
};

// Result: a line for each outcome and `what`, in the order of their first notes: "left out: the model file is not in
// the archive: "a.3ds", "b.3ds" and 12 more". Outcomes are in the order of their enum.
std::vector<std::string> report_lines(const ImportReport& report);

}  // namespace gonio::exchange
