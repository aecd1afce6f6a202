#include "server/exchange/import_report.h"

#include <algorithm>
#include <map>
#include <utility>

#include "protocol/text/shortened_text.h"

namespace gonio::exchange {

void ImportReport::add(Outcome outcome, std::string what, std::string_view name) {
    if (notes.size() >= kMaxNotes) {
        ++unlisted;
        return;
    }
    notes.push_back({outcome, std::move(what), shortened_text(name, kMaxNoteNameBytes)});
}

void ImportReport::add(const ImportReport& other, const std::string& prefix) {
    for (const ImportNote& note : other.notes) {
        const std::string name = prefix.empty() || note.name.empty() ? prefix + note.name : prefix + ": " + note.name;
        add(note.outcome, note.what, name);
    }
    unlisted += other.unlisted;
}

std::size_t ImportReport::count(Outcome outcome, std::string_view what) const {
    return static_cast<std::size_t>(std::count_if(notes.begin(), notes.end(), [&](const ImportNote& note) {
        return note.outcome == outcome && (what.empty() || note.what == what);
    }));
}

std::vector<std::string> report_lines(const ImportReport& report) {
    static constexpr const char* kOutcomes[] = {"taken", "defaulted", "guessed", "left out"};
    struct Line {
        Outcome outcome;
        std::string what, names;
        std::size_t count = 0;
    };
    std::vector<Line> lines;
    std::map<std::pair<Outcome, std::string>, std::size_t> place;
    for (const ImportNote& note : report.notes) {
        const auto [at, fresh] = place.try_emplace({note.outcome, note.what}, lines.size());
        if (fresh) lines.push_back({note.outcome, note.what, {}});
        Line& line = lines[at->second];
        if (note.name.empty()) continue;
        if (line.count++ < kNamesOfLine) line.names += (line.names.empty() ? "\"" : ", \"") + note.name + "\"";
    }
    std::stable_sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.outcome < b.outcome; });
    std::vector<std::string> result;
    for (const Line& line : lines) {
        std::string text = std::string(kOutcomes[static_cast<int>(line.outcome)]) + ": " + line.what;
        if (!line.names.empty()) text += ": " + line.names;
        if (line.count > kNamesOfLine) text += " and " + std::to_string(line.count - kNamesOfLine) + " more";
        result.push_back(std::move(text));
    }
    if (report.unlisted > 0)
        result.push_back("left out: " + std::to_string(report.unlisted) + " more notes of this report");
    return result;
}

}  // namespace gonio::exchange
