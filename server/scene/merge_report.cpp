#include "server/scene/merge_report.h"

namespace gonio {
namespace {

constexpr std::array<const char*, kMergedKinds> kMergedWords = {"added", "back",     "missing", "moved",   "turned",
                                                                "mode",  "light",    "patched", "renamed", "group",
                                                                "kept",  "conflict", "matched", "left out"};

}  // namespace

void MergeReport::add(MergeLine kind, const std::string& name, const std::string& what) {
    const auto at = static_cast<std::size_t>(kind);
    if (++counts_[at] > kMostMergeLines) return;
    lines_[at].push_back(std::string(kMergedWords[at]) + ": \"" + name + "\"" + (what.empty() ? "" : " " + what));
}

std::vector<std::string> MergeReport::lines(bool dry_run) const {
    std::string counted = dry_run ? "would be merged: " : "merged: ";
    const auto number = [&](const char* word, std::size_t count) {
        counted += std::string(word) + " " + std::to_string(count);
    };
    number("added", count(MergeLine::added) + count(MergeLine::back));
    number(", moved", count(MergeLine::moved));
    number(", mode", count(MergeLine::mode));
    number(", removed", count(MergeLine::removed));
    number(", unchanged", unchanged_);
    number(", conflicts", count(MergeLine::conflict));
    std::vector<std::string> all{counted};
    for (std::size_t kind = 0; kind < kMergedKinds; ++kind) {
        all.insert(all.end(), lines_[kind].begin(), lines_[kind].end());
        if (counts_[kind] > kMostMergeLines)
            all.push_back(std::string(kMergedWords[kind]) + ": and " + std::to_string(counts_[kind] - kMostMergeLines) +
                          " more");
    }
    return all;
}

}  // namespace gonio
