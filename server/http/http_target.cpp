#include "server/http/http_target.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "protocol/schema/measure.pb.h"
#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

constexpr std::string_view kStill = "/v1/frame.", kSceneFile = "/v1/scene.", kUploads = "/v1/uploads/",
                           kBlobs = "/v1/blobs/";

Error bad_target(std::string_view value, const char* message) {
    return {"bad_target", "", std::string(value.substr(0, 64)), message};
}

bool is_clean(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = utf8_length(text, at);
        if (length == 0 || static_cast<unsigned char>(text[at]) < 0x20 || text[at] == 0x7F) return false;
        at += length;
    }
    return true;
}

// RFC 3986, 2.1.
Result<std::string> decoded(std::string_view text) {
    std::string result;
    result.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            result += text[i];
            continue;
        }
        const int high = i + 1 < text.size() ? hex_digit(text[i + 1]) : -1;
        const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
        if (high < 0 || low < 0)
            return bad_target(text.substr(i, 3), "A % must be followed by two hexadecimal digits.");
        result += static_cast<char>(high * 16 + low);
        i += 2;
    }
    if (!is_clean(result)) return bad_target(text, "A target is UTF-8 without control characters.");
    return result;
}

Result<std::vector<HttpParameter>> parse_query(std::string_view text) {
    std::vector<HttpParameter> query;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('&'), text.size());
        const std::string_view part = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (part.empty()) continue;
        if (query.size() == kMaxParameters) return bad_target(part, "A target has at most 16 parameters.");
        const std::size_t equals = std::min(part.find('='), part.size());
        auto name = decoded(part.substr(0, equals));
        if (!name) return name.error();
        auto value = decoded(part.substr(std::min(equals + 1, part.size())));
        if (!value) return value.error();
        query.push_back({std::move(*name), std::move(*value)});
    }
    return query;
}

template <typename Number>
std::optional<Number> whole_text(std::string_view text) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

// What a parameter of stills sets. `set` says whether it could read the value; `must` is what it must be.
struct Row {
    const char* name;
    bool (*set)(v1::CaptureQuery& query, const std::string& value);
    const char* must;
};

template <std::string* (v1::CaptureQuery::*field)()>
bool set_text(v1::CaptureQuery& query, const std::string& value) {
    *(query.*field)() = value;
    return !value.empty();
}

template <void (v1::CaptureQuery::*set)(double)>
bool set_number(v1::CaptureQuery& query, const std::string& value) {
    const auto number = whole_text<double>(value);
    (query.*set)(number.value_or(0));
    return number.has_value() && std::isfinite(*number);
}

template <void (v1::CaptureQuery::*set)(bool)>
bool set_flag(v1::CaptureQuery& query, const std::string& value) {
    (query.*set)(value == "true");
    return value == "true" || value == "false";
}

constexpr Row kStillRows[] = {
    {"after_rev",
     [](v1::CaptureQuery& query, const std::string& value) {
         const auto rev = whole_text<std::uint32_t>(value);
         query.set_after_rev(rev.value_or(0));
         return rev.has_value();
     },
     "must be a whole number"},
    {"size",
     [](v1::CaptureQuery& query, const std::string& value) {
         const std::size_t x = std::min(value.find('x'), value.size());
         const auto width = whole_text<std::uint32_t>(std::string_view(value).substr(0, x));
         const auto height = whole_text<std::uint32_t>(std::string_view(value).substr(std::min(x + 1, value.size())));
         query.set_width_px(width.value_or(0));
         query.set_height_px(height.value_or(0));
         return width.value_or(0) > 0 && height.value_or(0) > 0;
     },
     "must be WIDTHxHEIGHT, in pixels"},
    {"view", set_text<&v1::CaptureQuery::mutable_view>, "must be the name of a view"},
    {"quality", set_text<&v1::CaptureQuery::mutable_quality>, "must be interactive or reference"},
    {"bounces", set_text<&v1::CaptureQuery::mutable_bounces>, "must be all or a whole number"},
    {"noise", set_number<&v1::CaptureQuery::set_noise_ratio>, "must be a number"},
    {"max_seconds", set_number<&v1::CaptureQuery::set_max_seconds>, "must be a number"},
    {"denoise", set_flag<&v1::CaptureQuery::set_denoise>, "must be true or false"},
    {"legend", set_flag<&v1::CaptureQuery::set_legend>, "must be true or false"},
    {"samples_per_pixel",
     [](v1::CaptureQuery& query, const std::string& value) {
         const auto samples = whole_text<std::uint32_t>(value);
         if (samples) query.set_samples_per_pixel(*samples);
         return samples.has_value();
     },
     "must be a whole number from 1 to 64"},
    {"openings", set_flag<&v1::CaptureQuery::set_openings>, "must be true or false"},
};

}  // namespace

Result<HttpTarget> parse_target(std::string_view target) {
    if (target.size() > kMaxTargetBytes)
        return Error{"too_large", "", std::to_string(target.size()) + " bytes", "A target has at most 4096 bytes."};
    HttpTarget result;
    std::string_view rest = target;
    if (!rest.starts_with('/')) {
        const std::size_t scheme = rest.find("://");
        const std::string_view name = rest.substr(0, std::min(scheme, rest.size()));
        if (scheme == std::string_view::npos || (name != "http" && name != "https"))
            return bad_target(target, "A target begins with / or http://.");
        rest.remove_prefix(scheme + 3);
        const std::size_t end = std::min(rest.find_first_of("/?"), rest.size());
        result.authority = std::string(rest.substr(0, end));
        if (result.authority->empty() || result.authority->find('@') != std::string::npos ||
            !is_clean(*result.authority))
            return bad_target(target, "The target names no host.");
        rest.remove_prefix(end);
    }
    if (rest.find('#') != std::string_view::npos) return bad_target(target, "A target has no fragment.");
    const std::size_t question = std::min(rest.find('?'), rest.size());
    auto path = decoded(rest.substr(0, question));
    if (!path) return path.error();
    result.path = path->empty() ? "/" : std::move(*path);
    auto query = parse_query(rest.substr(std::min(question + 1, rest.size())));
    if (!query) return query.error();
    result.query = std::move(*query);
    return result;
}

static bool is_scene_file(const HttpTarget& target) {
    if (!target.path.starts_with(kSceneFile)) return false;
    const std::string_view format = std::string_view(target.path).substr(kSceneFile.size());
    return format == "glb" || format == "mvr";
}

bool is_still(const HttpTarget& target) {
    if (!target.path.starts_with(kStill)) return is_scene_file(target);
    const std::string_view format = std::string_view(target.path).substr(kStill.size());
    return format == "png" || format == "jpg" || format == "exr";
}

Result<v1::CaptureQuery> still_query(const HttpTarget& target) {
    v1::CaptureQuery query;
    const bool scene = is_scene_file(target);
    const std::size_t prefix = scene ? kSceneFile.size() : kStill.size();
    query.set_format(target.path.substr(std::min(prefix, target.path.size())));
    for (auto parameter = target.query.begin(); parameter != target.query.end(); ++parameter) {
        const auto refusal = [&](const char* message) {
            return Error{"invalid_argument", parameter->name.substr(0, 64), parameter->value.substr(0, 64), message};
        };
        const Row* row = std::find_if(std::begin(kStillRows), std::end(kStillRows),
                                      [&](const Row& known) { return parameter->name == known.name; });
        if (scene && parameter->name != "after_rev") return refusal("is no parameter of scenes' files: after_rev");
        if (row == std::end(kStillRows))
            return refusal(
                "is no parameter of stills: after_rev, size, view, quality, bounces, noise, "
                "max_seconds, denoise, samples_per_pixel, openings or legend");
        if (std::any_of(target.query.begin(), parameter,
                        [&](const HttpParameter& earlier) { return earlier.name == parameter->name; }))
            return refusal("is given twice");
        if (!row->set(query, parameter->value)) return refusal(row->must);
    }
    return query;
}

std::optional<std::string> upload_name(const HttpTarget& target) {
    if (!target.path.starts_with(kUploads)) return std::nullopt;
    return target.path.substr(kUploads.size());
}

std::optional<std::string> blob_name(const HttpTarget& target) {
    if (!target.path.starts_with(kBlobs)) return std::nullopt;
    return target.path.substr(kBlobs.size());
}

}  // namespace gonio
