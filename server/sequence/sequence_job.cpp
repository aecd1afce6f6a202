#include "server/sequence/sequence_job.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "protocol/schema/measure.pb.h"
#include "protocol/schema/words.h"
#include "protocol/timecode/timecode.h"
#include "server/render/live_renderer.h"
#include "server/scene/scene.h"

namespace gonio::sequence {
namespace {

using job::item;
using job::Json;
using job::refuse;

double time_at(const Json& object, const char* key, const std::string& place, std::optional<double> otherwise) {
    return job::number_within(object, key, place, -kMostTime_s, kMostTime_s, otherwise);
}

Ease ease_at(const Json& object, const std::string& place) {
    const std::string name = job::text_at(object, "ease", place, "linear");
    const auto ease = parse_ease(name);
    if (!ease) refuse(place + ".ease", name, "must be linear, hold, in, out or in-out");
    return *ease;
}

bool smooth_at(const Json& object, const std::string& place, const char* otherwise) {
    const std::string name = job::text_at(object, "curve", place, otherwise);
    if (name != "linear" && name != "smooth") refuse(place + ".curve", name, "must be linear or smooth");
    return name == "smooth";
}

// A number, a list of numbers, or a text that stands as it is.
void take_value(const Json& value, const std::string& place, Key& key) {
    if (value.is_number()) {
        key.numbers = {value.get<double>()};
    } else if (value.is_string()) {
        key.text = value;
    } else if (value.is_array() && !value.empty() && value.size() <= kMostNumbers) {
        for (const Json& number : value) {
            if (!number.is_number()) refuse(place, number, "must be a number");
            key.numbers.push_back(number);
        }
    } else {
        refuse(place, value, "must be a number, a list of 1 to 16 numbers, or a text");
    }
}

void add_key(Track& track, Key key, const std::string& place) {
    if (!track.keys.empty()) {
        const Key& before = track.keys.back();
        if (!(key.t_s > before.t_s))
            refuse(place + ".t", print_number(key.t_s), "must be after the key before: " + print_number(before.t_s));
        if (key.numbers.size() != before.numbers.size())
            refuse(place + ".value", std::to_string(key.numbers.size()),
                   "must be as many numbers as that of the key before: " + std::to_string(before.numbers.size()));
    }
    track.keys.push_back(std::move(key));
}

Track track_of(const Json& json, const std::string& place) {
    job::expect_object(json, place, {"set", "keys", "curve", "ease"});
    Track track;
    track.place = place;
    if (!json.contains("set")) refuse(place + ".set", "", "must be a list of words");
    track.words = job::words_of(json["set"], place + ".set");
    if (track.words.back().starts_with("--")) {
        track.option = track.words.back();
        track.words.pop_back();
    }
    if (track.words.empty()) refuse(place + ".set", json["set"], "must begin with what is set: light, camera, …");
    if (track.words.front() != "set") track.words.insert(track.words.begin(), "set");
    track.smooth = smooth_at(json, place, "linear");
    track.ease = ease_at(json, place);
    const Json& keys = job::list_at(json, "keys", place, 1, kMostKeys);
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const std::string at = item(place + ".keys", i);
        job::expect_object(keys[i], at, {"t", "value", "ease"});
        Key key{time_at(keys[i], "t", at, std::nullopt), {}, "", ease_at(keys[i], at)};
        if (!keys[i].contains("value")) refuse(at + ".value", "", "must be a number, a list of numbers, or a text");
        take_value(keys[i]["value"], at + ".value", key);
        add_key(track, std::move(key), at);
    }
    return track;
}

// The camera's path: what its keys have of eye, target and fov, each a track.
void add_camera(const Json& json, const std::string& place, std::vector<Track>& tracks) {
    job::expect_object(json, place, {"keys", "curve", "ease"});
    const Json& keys = job::list_at(json, "keys", place, 1, kMostKeys);
    for (const char* field : {"eye", "target", "fov"}) {
        Track track;
        track.words = {"set", "camera"};
        track.option = std::string("--") + field;
        track.place = place;
        track.smooth = smooth_at(json, place, "smooth");
        track.ease = ease_at(json, place);
        for (std::size_t i = 0; i < keys.size(); ++i) {
            const std::string at = item(place + ".keys", i);
            job::expect_object(keys[i], at, {"t", "eye", "target", "fov", "ease"});
            Key key{time_at(keys[i], "t", at, std::nullopt), {}, "", ease_at(keys[i], at)};
            if (!keys[i].contains(field)) continue;
            take_value(keys[i][field], at + "." + field, key);
            if (key.numbers.size() != (std::string_view(field) == "fov" ? 1u : 3u))
                refuse(at + "." + field, keys[i][field],
                       std::string_view(field) == "fov" ? "must be a number" : "must be three numbers");
            add_key(track, std::move(key), at);
        }
        if (!track.keys.empty()) tracks.push_back(std::move(track));
    }
}

std::vector<Event> events_of(const Json& json, const std::string& place) {
    std::vector<Event> events;
    const Json& list = job::list_at(json, "events", place, 0, kMostEvents);
    for (std::size_t i = 0; i < list.size(); ++i) {
        const std::string at = item(place + ".events", i);
        job::expect_object(list[i], at, {"t", "set"});
        if (!list[i].contains("set")) refuse(at + ".set", "", "must be a list of words");
        events.push_back({time_at(list[i], "t", at, std::nullopt), job::words_of(list[i]["set"], at + ".set"), at});
    }
    std::ranges::stable_sort(events, {}, &Event::t_s);
    return events;
}

void take_timecode(const Json& json, const std::string& place, Sequence& sequence) {
    job::expect_object(json, place, {"start", "rate"});
    const std::string text = job::text_at(json, "start", place, "00:00:00:00"),
                      rate = job::text_at(json, "rate", place, "25");
    const auto label = parse_timecode(text);
    const char* const names[] = {"24", "25", "29.97", "30"};
    const auto* const found = std::ranges::find(names, rate);
    if (found == std::end(names)) refuse(place + ".rate", rate, "must be 24, 25, 29.97 or 30");
    const Timecode timecode{label.value_or(TimecodeLabel{}), static_cast<TimecodeRate>(found - names)};
    if (!label || !is_timecode(timecode)) refuse(place + ".start", text, "must be HH:MM:SS:FF of that rate");
    sequence.timecode_s = seconds_of(timecode);
    sequence.timecode_rate = timecode.rate;
}

Rate rate_at(const Json& json, const std::string& place) {
    if (!json.contains("fps")) return {};
    const std::string text = json["fps"].is_string() ? json["fps"].get<std::string>() : json["fps"].dump();
    const auto rate = parse_rate(text);
    if (!rate) refuse(place + ".fps", json["fps"], "must be 0.001 to 1000 of three decimals, or \"24000/1001\"");
    return *rate;
}

// The time range: "from" and either "frames" or "to", which is the first time after the last frame.
void take_range(const Json& json, const std::string& place, Sequence& sequence) {
    sequence.from_s = time_at(json, "from", place, 0.0);
    if (json.contains("frames") == json.contains("to"))
        refuse(place, "", "must have either frames, how many, or to, the time in s where it ends");
    if (json.contains("frames")) {
        sequence.frames = job::whole_within(json, "frames", place, 1, kMostFrames, std::nullopt);
        return;
    }
    const double to_s = time_at(json, "to", place, std::nullopt),
                 frames = std::round((to_s - sequence.from_s) * sequence.fps.per_second());
    if (!(frames >= 1.0 && frames <= kMostFrames))
        refuse(place + ".to", json["to"],
               "must make 1 to " + std::to_string(kMostFrames) + " frames, not " + print_number(frames));
    sequence.frames = static_cast<int>(frames);
}

void take_out(const Json& json, const std::string& place, Sequence& sequence) {
    sequence.out = job::text_at(json, "out", place, "frame.####.png");
    const std::string at = place + ".out";
    check_inside(sequence.out, at);
    const std::size_t begin = sequence.out.find('#'), end = sequence.out.find_first_not_of('#', begin);
    const bool once = begin != std::string::npos && end != std::string::npos && end - begin <= 9 &&
                      sequence.out.find('#', end) == std::string::npos;
    if (!once) refuse(at, sequence.out, "must have one run of 1 to 9 # where the frame's number goes");
    const auto format = capture_format(sequence.out);
    if (!format) refuse(at, sequence.out, "must end in .png, .jpg or .exr");
    sequence.format = *format;
    sequence.first_number = job::whole_within(json, "first_number", place, 0, 1'000'000, 0);
}

void take_capture(const Json& capture, const std::string& place, Sequence& sequence) {
    job::expect_object(
        capture, place,
        {"view", "quality", "bounces", "noise", "samples_per_pixel", "denoise", "legend", "size", "layers"});
    sequence.query = query_of(capture, sequence.format, place);
    if (!capture.contains("layers")) return;
    const std::string at = place + ".layers";
    if (sequence.format != "exr") refuse(at, sequence.format, "only .exr has layers");
    if (capture.contains("view")) refuse(at, capture["view"], "a file of layers has no view of its own");
    const Json all = kLayerNames;
    const Json& list = capture["layers"] == "all" ? all : job::list_at(capture, "layers", place, 1, kLayerNames.size());
    std::set<LayerKind> kinds;
    for (std::size_t i = 0; i < list.size(); ++i) {
        const auto found = list[i].is_string()
                               ? std::ranges::find(kLayerNames, std::string_view(list[i].get_ref<const std::string&>()))
                               : kLayerNames.end();
        if (found == kLayerNames.end())
            refuse(item(at, i), list[i],
                   "must be beauty, direct, indirect, illuminance, luminance, depth, normal or id");
        const auto kind = static_cast<LayerKind>(found - kLayerNames.begin());
        if (!kinds.insert(kind).second) refuse(item(at, i), list[i], "must be there once");
    }
    sequence.layers.assign(kinds.begin(), kinds.end());
}

void take_video(const Json& video, const std::string& place, Sequence& sequence) {
    job::expect_object(video, place, {"file", "crf"});
    sequence.video.file = job::text_at(video, "file", place, "");
    const std::string& file = sequence.video.file;
    check_inside(file, place + ".file");
    if (!file.ends_with(".mp4") && !file.ends_with(".mkv")) refuse(place + ".file", file, "must end in .mp4 or .mkv");
    if (sequence.format == "exr")
        refuse(place + ".file", file, "a video is made of .png or .jpg: values have no exposure");
    sequence.video.crf = job::number_within(video, "crf", place, 0.0, 51.0, 18.0);
}

}  // namespace

void check_inside(const std::string& name, const std::string& place) {
    const std::filesystem::path path(name), plain = path.lexically_normal();
    const bool leaves = name.empty() || name.size() > kMostPatternBytes || path.is_absolute() || plain.empty() ||
                        name.find('\0') != std::string::npos || name.ends_with("/");
    bool odd = leaves;
    for (const std::filesystem::path& part : path) odd |= part.string().starts_with(".");
    if (odd)
        refuse(place, name,
               "must name a file inside the output folder, of at most 200 bytes, no part of it beginning with a dot");
}

v1::CaptureQuery query_of(const Json& capture, const std::string& format, const std::string& place) {
    v1::CaptureQuery query;
    query.set_format(format);
    query.set_view(job::text_at(capture, "view", place, ""));
    query.set_quality(job::text_at(capture, "quality", place, ""));
    if (capture.contains("bounces")) {
        const Json& bounces = capture["bounces"];
        query.set_bounces(bounces.is_string() ? bounces.get<std::string>() : bounces.dump());
    }
    if (const auto noise = job::number_at(capture, "noise", place)) query.set_noise_ratio(*noise);
    if (const auto seconds = job::number_at(capture, "max_seconds", place)) query.set_max_seconds(*seconds);
    if (capture.contains("samples_per_pixel"))
        query.set_samples_per_pixel(static_cast<std::uint32_t>(job::whole_within(
            capture, "samples_per_pixel", place, 1, static_cast<int>(kMostSamplesPerPixel), std::nullopt)));
    query.set_openings(job::flag_at(capture, "openings", place));
    query.set_denoise(job::flag_at(capture, "denoise", place));
    query.set_legend(job::flag_at(capture, "legend", place));
    if (const std::string size = job::text_at(capture, "size", place, ""); !size.empty()) {
        const auto parsed = parse_size(size);
        if (!parsed || parsed->first < 1 || parsed->second < 1 || parsed->first > 4096 || parsed->second > 4096)
            refuse(place + ".size", size, "must be WIDTHxHEIGHT, 1 to 4096 a side");
        query.set_width_px(parsed->first);
        query.set_height_px(parsed->second);
    }
    return query;
}

std::string exr_date_of(const Json& object, const std::string& place) {
    const std::string text = job::text_at(object, "date", place, "1970-01-01T00:00:00Z");
    int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, used = 0;
    const int fields =
        std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2dZ%n", &year, &month, &day, &hour, &minute, &second, &used);
    if (fields != 6 || text.size() != 20 || used != 20 || month < 1 || month > 12 || day < 1 || day > 31 || hour < 0 ||
        hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60 || year < 0)
        refuse(place + ".date", text, "must be YYYY-MM-DDTHH:MM:SSZ");
    std::string date = text.substr(0, 19);
    date[4] = date[7] = ':';
    date[10] = ' ';
    return date;
}

Sequence sequence_of(const Json& json) {
    const std::string place = "sequence";
    job::expect_object(json, place,
                       {"fps", "from", "to", "frames", "out", "first_number", "capture", "set", "tracks", "camera",
                        "events", "timecode", "video", "date"});
    Sequence sequence;
    sequence.fps = rate_at(json, place);
    take_range(json, place, sequence);
    take_out(json, place, sequence);
    take_capture(json.contains("capture") ? json["capture"] : Json::object(), place + ".capture", sequence);
    sequence.date = exr_date_of(json, place);
    if (json.contains("video")) take_video(json["video"], place + ".video", sequence);
    const Json& set = job::list_at(json, "set", place, 0, kMostEvents);
    for (std::size_t i = 0; i < set.size(); ++i) sequence.set.push_back(job::words_of(set[i], item(place + ".set", i)));
    const Json& tracks = job::list_at(json, "tracks", place, 0, kMostTracks);
    for (std::size_t i = 0; i < tracks.size(); ++i)
        sequence.tracks.push_back(track_of(tracks[i], item(place + ".tracks", i)));
    if (json.contains("camera")) add_camera(json["camera"], place + ".camera", sequence.tracks);
    std::size_t keys = 0;
    for (const Track& track : sequence.tracks) keys += track.keys.size();
    if (keys > kMostAllKeys)
        refuse(place + ".tracks", std::to_string(keys), "may have at most " + std::to_string(kMostAllKeys) + " keys");
    sequence.events = events_of(json, place);
    if (json.contains("timecode")) take_timecode(json["timecode"], place + ".timecode", sequence);
    Json frames = json;
    frames.erase("video");
    sequence.text = frames.dump(-1, ' ', false, Json::error_handler_t::replace);
    return sequence;
}

}  // namespace gonio::sequence
