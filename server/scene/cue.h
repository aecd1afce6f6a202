// A cue: what a preset keeps, under a number, with the times that bring it about. The list is the scene's; what plays
// it is cue_player.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/cue_number.h"
#include "protocol/timecode/timecode.h"
#include "server/scene/light.h"

namespace gonio::v1 {
class Cue;
}

namespace gonio {

struct Scene;

using CueNumber = std::uint32_t;  // thousandths; 0: no cue
enum class TimecodeSource : std::uint8_t { off, mtc, artnet };
struct CueOptions {
    double guard_s = 0.2;  // a GO so soon after another is refused
    double back_s = 1.0;
    double freewheel_s = 1.0;  // how long time goes on when time code ends
    TimecodeSource timecode = TimecodeSource::off;
    bool operator==(const CueOptions&) const = default;
};

inline constexpr double kMaxCueTime_s = 3600.0, kDefaultCue_s = 5.0;
inline constexpr double kMostGuard_s = 5.0, kLeastFreewheel_s = 0.5, kMostFreewheel_s = 2.0;

struct Cue {
    CueNumber number = 0;
    std::string label;
    double up_s = kDefaultCue_s;    // of levels that rise, and of all that is no level
    double down_s = kDefaultCue_s;  // of levels that fall
    double delay_up_s = 0.0, delay_down_s = 0.0;
    std::optional<double> follow_s, hang_s;  // never both: from its start, from its end
    std::optional<TimecodeLabel> timecode;
    std::shared_ptr<const Preset> content;  // never null
    double duration_s() const { return std::max(delay_up_s + up_s, delay_down_s + down_s); }
};
using CueList = std::vector<std::shared_ptr<const Cue>>;  // by number, each once

// Result: the cue of this number, or nullptr.
const Cue* find_cue(const Scene& scene, CueNumber number);
std::shared_ptr<const Cue> cue_of(const Scene& scene, CueNumber number);
// Result: the number of the next one in the list after `number` and of the one before it, which need not be there; 0:
// there is none.
CueNumber cue_after(const Scene& scene, CueNumber number);
CueNumber cue_before(const Scene& scene, CueNumber number);

// Adds the cue, or replaces the one of its number; takes one away. The next one stays the next one.
void put_cue(Scene& scene, std::shared_ptr<const Cue> cue);
void erase_cue(Scene& scene, CueNumber number);
// Result: lights that all cues keep.
std::size_t cue_lights(const Scene& scene);

const char* timecode_source_name(TimecodeSource source);
void put_cue(const Cue& cue, v1::Cue& out);

}  // namespace gonio
