// Fader boxes as people read them, and the words of `gonio learn`. Pure functions.
#pragma once

#include <optional>
#include <string>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/schema/word_table.h"

namespace gonio {

// Result: a block for each box with its controls and what each drives. Then come the rows for what is not there,
// warnings, and how long a movement takes to the picture.
std::string surfaces_table(const v1::Surfaces& surfaces);

struct LearnWords {
    std::optional<v1::SurfaceRow> row;  // what the control shall drive, without device and control; absent: only named
    double timeout_s = 30;
    bool any_box = false;  // the row is for every box that has a control of this name
};
// words: of `gonio learn`, without a fault. Whether the property exists is asked here, whether the light does by the
// server. Errors: "usage".
Result<LearnWords> learn_request(const ReadWords& words);

}  // namespace gonio
