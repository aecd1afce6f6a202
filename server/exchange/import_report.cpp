#include "server/exchange/import_report.h"

#include <algorithm>
#include <utility>

#include "protocol/text/shortened_text.h"

namespace gonio::exchange {

namespace {

// Result: the note that says so, made where there is none; nullptr where it would be beyond kMaxNotes.
ImportNote* note_of(ImportReport& report, Outcome outcome, std::string what) {
    std::pair<Outcome, std::string> key{outcome, std::move(what)};
    if (const auto at = report.places.find(key); at != report.places.end()) return &report.notes[at->second];
    if (report.notes.size() >= kMaxNotes) return nullptr;
    report.notes.push_back({outcome, key.second});
    report.places.emplace(std::move(key), report.notes.size() - 1);
    return &report.notes.back();
}

void add_name(ImportNote& note, std::string_view name) {
    if (note.names.size() < kNamesOfLine) note.names.push_back(shortened_text(name, kMaxNoteNameBytes));
}

}  // namespace

void ImportReport::add(Outcome outcome, std::string what, std::string_view name) {
    ImportNote* const note = note_of(*this, outcome, std::move(what));
    if (note == nullptr) {
        ++unlisted;
        return;
    }
    ++note->count;
    if (name.empty()) return;
    ++note->named;
    add_name(*note, name);
}

void ImportReport::add(const ImportReport& other, const std::string& prefix) {
    for (const ImportNote& from : other.notes) {
        ImportNote* const note = note_of(*this, from.outcome, from.what);
        if (note == nullptr) {
            unlisted += from.count;
            continue;
        }
        note->count += from.count;
        note->named += prefix.empty() ? from.named : from.count;
        for (const std::string& name : from.names) add_name(*note, prefix.empty() ? name : prefix + ": " + name);
        if (prefix.empty()) continue;
        for (std::size_t i = from.named; i < from.count && note->names.size() < kNamesOfLine; ++i)
            add_name(*note, prefix);
    }
    unlisted += other.unlisted;
}

std::size_t ImportReport::count(Outcome outcome, std::string_view what) const {
    std::size_t sum = 0;
    for (const ImportNote& note : notes)
        if (note.outcome == outcome && (what.empty() || note.what == what)) sum += note.count;
    return sum;
}

namespace {

std::string line_of(const ImportNote& note) {
    static constexpr const char* kOutcomes[] = {"taken", "defaulted", "guessed", "left out"};
    std::string text = std::string(kOutcomes[static_cast<int>(note.outcome)]) + ": " + note.what;
    for (std::size_t i = 0; i < note.names.size(); ++i) text += (i == 0 ? ": \"" : ", \"") + note.names[i] + "\"";
    if (note.named > note.names.size()) text += " and " + std::to_string(note.named - note.names.size()) + " more";
    return text;
}

std::vector<std::string> lines_of(const ImportReport& report, bool taken) {
    std::vector<const ImportNote*> notes;
    for (const ImportNote& note : report.notes)
        if ((note.outcome == Outcome::taken) == taken) notes.push_back(&note);
    std::ranges::stable_sort(notes, {}, [](const ImportNote* note) { return note->outcome; });
    std::vector<std::string> lines;
    for (const ImportNote* const note : notes) lines.push_back(line_of(*note));
    return lines;
}

}  // namespace

std::vector<std::string> report_lines(const ImportReport& report) {
    std::vector<std::string> lines = lines_of(report, false);
    if (report.unlisted > 0)
        lines.push_back("left out: " + std::to_string(report.unlisted) + " more notes of this report");
    return lines;
}

std::vector<std::string> taken_lines(const ImportReport& report) {
    return lines_of(report, true);
}

}  // namespace gonio::exchange
