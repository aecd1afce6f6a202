// What of a bake is finished, kept in files, so that a bake that was stopped goes on, and one that changes a luminaire
// computes that one alone. Any thread; no two bakes in one folder at a time.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace gonio::bake {

// Values of a part: of all texels.
struct PartValues {
    std::vector<float> values;  // `channels` each, lx
    std::vector<float> error;   // one each
    std::uint64_t rays = 0;     // that it took
    double seconds = 0.0;
};

class PartStore {
public:
    // folder: is made when something is kept; empty: nothing is.
    explicit PartStore(std::string folder = "") : folder_(std::move(folder)) {}

    // Result: the part of this name if its file has this key and so many values. A file that is damaged is none.
    std::optional<PartValues> load(const std::string& name, const std::string& key, std::size_t values,
                                   std::size_t errors) const;
    // Result: whether it is kept; a disk that is full keeps nothing, and the bake goes on.
    bool save(const std::string& name, const std::string& key, const PartValues& part) const;

private:
    std::string folder_;
};

}  // namespace gonio::bake
