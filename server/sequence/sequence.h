// A sequence of frames: what JOB.json says of it (docs/sequences.md), and what its tracks say at a time. Plain data; no
// scene, no files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/schema/measure.pb.h"
#include "protocol/timecode/timecode.h"
#include "server/sequence/easing.h"

namespace gonio::sequence {

inline constexpr int kMostFrames = 100'000;
inline constexpr std::size_t kMostTracks = 256, kMostKeys = 10'000, kMostAllKeys = 100'000, kMostEvents = 10'000;
inline constexpr std::size_t kMostNumbers = 16;        // of a value
inline constexpr std::size_t kMostPatternBytes = 200;  // of a name of frames, or of the video
inline constexpr double kMostTime_s = 86'400.0;
inline constexpr int kMostShards = 10'000;

struct Rate {
    std::int64_t numerator = 24, denominator = 1;  // frames in so many seconds
    double per_second() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
};
// Result: of "24", "23.976" or "24000/1001", 0.001 to 1000 a second; nothing for other texts.
std::optional<Rate> parse_rate(const std::string& text);

struct Key {
    double t_s = 0.0;
    std::vector<double> numbers;  // or
    std::string text;
    Ease ease = Ease::linear;  // to the next key
};
// One property over time. Before its first key it has that one's value, after the last that one's.
struct Track {
    std::vector<std::string> words;  // of a set command, without the option: {"set", "light", "spot"}
    std::string option;              // "--level"; empty: the value is a word
    std::vector<Key> keys;           // by time, at least one
    bool smooth = false;             // by a cubic through the keys (Catmull-Rom), else straight between them
    Ease ease = Ease::linear;        // of all its time: from its first key to the last
    std::string place;               // in the job
};
// Result: the value as a word: "0.25", "1,2,3", "L201". Numbers are exact: they read back as they are.
std::string value_at(const Track& track, double t_s);

struct Event {
    double t_s = 0.0;
    std::vector<std::string> words;
    std::string place;
};

// The pictures that a frame's file holds.
enum class LayerKind : std::uint8_t { beauty, direct, indirect, illuminance, luminance, depth, normal, id };
inline constexpr std::array<std::string_view, 8> kLayerNames = {"beauty",    "direct", "indirect", "illuminance",
                                                                "luminance", "depth",  "normal",   "id"};

struct VideoOutput {
    std::string file;  // .mp4 or .mkv, relative; empty: none
    double crf = 18.0;
};

struct Sequence {
    Rate fps;
    double from_s = 0.0;
    int frames = 0;
    std::string out;  // with one run of #: where the number goes
    int first_number = 0;
    std::string format;  // "png", "jpg" or "exr"
    v1::CaptureQuery query;
    std::vector<LayerKind> layers;             // empty: the query's view alone, as captures are
    std::string date = "1970:01:01 00:00:00";  // as EXR has it
    VideoOutput video;
    std::vector<std::vector<std::string>> set;  // before the first frame
    std::vector<Track> tracks;
    std::vector<Event> events;         // by time
    std::optional<double> timecode_s;  // what time code is at from_s, for cues that have one; none: it is off
    TimecodeRate timecode_rate = TimecodeRate::ebu25;
    std::string text;  // what of the job the frames depend on: all but the video

    double time_s(int frame) const {
        return from_s +
               static_cast<double>(frame) * static_cast<double>(fps.denominator) / static_cast<double>(fps.numerator);
    }
};
// Result: the name of a frame's file: "stills/0012.png".
std::string frame_name(const Sequence& sequence, int frame);

struct Shard {
    int index = 0, count = 1;
    bool has(int frame) const { return frame % count == index; }
};
// Result: of "i/n", 0 <= i < n <= kMostShards; nothing for other texts.
std::optional<Shard> parse_shard(const std::string& text);

}  // namespace gonio::sequence
