// Which profile a box has: one that somebody gave it, one that is shipped for its vendor and product, or an input
// profile of QLC+ that bears the name that the box gives itself.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/surface/box.h"

namespace gonio {

class BoxProfiles {
public:
    // given: "vvvv:pppp" -> a .toml or .qxi file. Errors: of the reader, the file's name before the place; "not_found".
    static Result<BoxProfiles> load(const std::map<std::string, std::string>& given);
    // Result: the profile of a box; an empty one (without a name) where there is none.
    BoxProfile find(const std::string& id, const std::string& product) const;
    // Result: every "vvvv:pppp" that has a profile: such boxes are fader boxes.
    std::vector<std::string> ids() const;

private:
    std::map<std::string, BoxProfile> by_id_;
};

}  // namespace gonio
