// What the merge of a show's next edition changes, in lines for people. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace gonio {

inline constexpr std::size_t kMostMergeLines = 64;  // of a kind; the rest is counted in one line more

enum class MergeLine : std::uint8_t {  // in the order of their lines
    added,
    back,     // its fixture was missing
    removed,  // its fixture is missing now
    moved,
    turned,
    mode,  // or type
    web,
    patched,
    renamed,
    group,
    kept,      // what was edited here, and the file does not change
    conflict,  // edited here, and the file counts
    matched,   // by something else than its UUID
    left_out,
};
inline constexpr std::size_t kMergedKinds = static_cast<std::size_t>(MergeLine::left_out) + 1;

class MergeReport {
public:
    void add(MergeLine kind, const std::string& name, const std::string& what = {});
    // A light that neither the file nor anybody here has changed.
    void add_unchanged() { ++unchanged_; }
    std::size_t count(MergeLine kind) const { return counts_[static_cast<std::size_t>(kind)]; }
    // Result: "added 12, moved 30, mode 2, removed 1, unchanged 140, conflicts 0", then a line for each change.
    std::vector<std::string> lines(bool dry_run) const;

private:
    std::array<std::vector<std::string>, kMergedKinds> lines_;
    std::array<std::size_t, kMergedKinds> counts_{};
    std::size_t unchanged_ = 0;
};

}  // namespace gonio
