#include <algorithm>

#include "ies/fold.h"
#include "ies/writers.h"

namespace gonio::ies {

namespace {

constexpr std::string_view kLineEnd = "\r\n";
constexpr std::size_t kNumbersPerLine = 10;

// A row of numbers over as many lines as it takes; a comma never separates, since many readers do not take it.
template <typename Numbers>
void append_row(std::string& text, const Numbers& numbers) {
    std::size_t written = 0;
    for (const auto number : numbers) {
        if (written > 0) text += written % kNumbersPerLine == 0 ? kLineEnd : " ";
        detail::append_number(text, number);
        ++written;
    }
    text += kLineEnd;
}

void append_keyword(std::string& text, std::string_view key, std::string_view value) {
    std::string_view name = key.empty() ? "OTHER" : key;
    std::size_t at = 0;
    do {
        const std::size_t end = std::min(value.find('\n', at), value.size());
        text += '[';
        detail::append_line(text, name);
        text += "] ";
        detail::append_line(text, value.substr(at, end - at));
        text += kLineEnd;
        at = end + 1;
        name = "MORE";
    } while (at <= value.size());
}

void append_header(std::string& text, const Photometry& photometry) {
    text += "IES:LM-63-2019";
    text += kLineEnd;
    const auto& keywords = photometry.provenance.keywords;
    for (const std::string_view required : {"TEST", "TESTLAB", "ISSUEDATE", "MANUFAC"}) {
        const bool present =
            std::any_of(keywords.begin(), keywords.end(), [&](const auto& entry) { return entry.first == required; });
        if (!present) append_keyword(text, required, "unknown");
    }
    for (const auto& [key, value] : keywords) append_keyword(text, key, value);
}

void append_tilt(std::string& text, const std::optional<TiltTable>& tilt) {
    text += tilt ? "TILT=INCLUDE" : "TILT=NONE";
    text += kLineEnd;
    if (!tilt) return;
    append_row(text, std::vector{static_cast<double>(tilt->lamp_geometry)});
    append_row(text, std::vector{static_cast<double>(tilt->angle_rad.size())});
    std::vector<double> degrees;
    for (const double angle : tilt->angle_rad) degrees.push_back(detail::tidy_degrees(angle));
    append_row(text, degrees);
    append_row(text, tilt->factor);
}

// Signs of width, length and height by shape, in the order of OpeningShape (LM-63-2002 table 1).
constexpr int kSigns[][3] = {{0, 0, 0},    {1, 1, 0},   {1, 1, 1},   {-1, -1, 0}, {-1, -1, 1},
                             {-1, -1, -1}, {-1, 1, -1}, {1, -1, -1}, {-1, 0, -1}};

}  // namespace

std::string write_lm63(const Photometry& photometry) {
    const PhotometricWeb& web = photometry.web;
    const Provenance& provenance = photometry.provenance;
    std::vector<std::size_t> columns;
    if (web.goniometer == Goniometer::type_c) {
        columns = detail::fold(web).columns;
    } else {
        for (std::size_t h = 0; h < web.h_rad.size(); ++h) columns.push_back(h);
    }
    std::string text;
    text.reserve(1024 + 9 * columns.size() * web.v_rad.size());
    append_header(text, photometry);
    append_tilt(text, photometry.tilt);
    const Opening& opening = photometry.opening;
    const int(&signs)[3] = kSigns[static_cast<std::size_t>(opening.shape)];
    append_row(text, std::vector{static_cast<double>(std::max(1, provenance.lamps)),
                                 provenance.absolute ? -1.0 : provenance.lumens_per_lamp, 1.0,
                                 static_cast<double>(web.v_rad.size()), static_cast<double>(columns.size()),
                                 static_cast<double>(web.goniometer) + 1.0, 2.0, signs[0] * opening.width.in(m),
                                 signs[1] * opening.length.in(m), signs[2] * opening.height.in(m)});
    // LM-63-2019 table 2: 1.00001 is "undefined", for webs that come from other formats.
    const std::string& generation = photometry.file_generation_type;
    text += "1 " + (generation.empty() ? std::string("1.00001") : generation) + " ";
    append_row(text, std::vector{provenance.input_watts});
    std::vector<double> degrees;
    for (const double v : web.v_rad) degrees.push_back(detail::tidy_degrees(v));
    append_row(text, degrees);
    degrees.clear();
    for (const std::size_t h : columns) degrees.push_back(detail::tidy_degrees(web.h_rad[h]));
    append_row(text, degrees);
    for (const std::size_t h : columns) append_row(text, detail::column(web, h));
    return text;
}

}  // namespace gonio::ies
