// The names of the messages that headers speak of; <subject>.pb.h has the messages themselves. A file that includes
// only this one is not compiled anew when a message changes.
#pragma once

namespace google::protobuf {
class Message;  // any of them
}

namespace gonio::v1 {

class AddLight;
class Beam;
class BeamQuery;
class CaptureQuery;
class ClientMessage;
class Command;
class Control;
class CuePlayback;
class EditLights;
class FrameReport;
class Gels;
class GlareSource;
class Grid;
class GridQuery;
class GridValues;
class Grids;
class Haze;
class Identify;
class InputEndpoint;
class Library;
class LibraryQuery;
class LibraryRow;
class LoadScene;
class LuxReportQuery;
class MapControl;
class MeterQuery;
class MeterReading;
class Observer;
class Observers;
class OpenShow;
class Patch;
class PatchRow;
class PhotometrySummary;
class Pick;
class PickQuery;
class ProfileReply;
class Progress;
class Ready;
class RenameLight;
class Result;
class SavedView;
class ServerMessage;
class SetGroup;
class SetHaze;
class SetLight;
class SetPatch;
class SetSurfaces;
class ShowFile;
class Shows;
class Sources;
class State;
class StateChanged;
class Stats;
class SurfaceDevice;
class SurfaceRow;
class Surfaces;
class Target;
class TargetCheck;
class Targets;
class Ugr;
class UgrQuery;
class UndoState;
class VideoConfig;

}  // namespace gonio::v1
