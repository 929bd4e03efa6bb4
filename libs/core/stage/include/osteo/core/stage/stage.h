// A stage: one step from CT to case, declared once, used as function, VTK filter, command and pipeline node.
//
// A stage type S has
//   struct Params { ...; };                                  defaults in place
//   static void describe(Params&, auto& visit);               each field once
//   static StageInfo info();                                  name, help, typed ports, references
//   static std::vector<Data> run(const Params&, std::span<const Data> inputs, const Context&);
// and a plain function beside it that does the work on plain values.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/data.h"

namespace osteo {

struct Port {
  std::string name;
  std::vector<DataKind> kinds;  ///< an input accepts any of these; an output is of the first
  std::string help;
  bool optional = false;    ///< input: may be left out. Output: saved only when asked for
  std::string beside = {};  ///< output: on the command line saved beside the first output, with this added to its name
};

struct StageInfo {
  std::string name;      ///< command and pipeline name: lower case, dashes
  int version = 1;       ///< raise it when the same parameters give another result: old results are then made again
  std::string synopsis;  ///< one line
  std::string description;
  std::vector<Port> inputs, outputs;
  std::vector<std::string> references;  ///< papers and sections that the method follows
  std::string example;                  ///< a command line that works
};

/// An Error of a stage that still has something to show: the runner saves it to the port, if that is wanted, and throws
/// on. A picture (SVG) goes beside it, with .svg in place of .json.
class ErrorWithDocument : public Error {
 public:
  ErrorWithDocument(const Error& error, std::string port, Document document, std::string picture = {})
      : Error(error), port_(std::move(port)), document_(std::move(document)), picture_(std::move(picture)) {}
  [[nodiscard]] const std::string& port() const { return port_; }
  [[nodiscard]] const Document& document() const { return document_; }
  [[nodiscard]] const std::string& picture() const { return picture_; }

 private:
  std::string port_;
  Document document_;
  std::string picture_;
};

/// A stage with its parameters. Not thread-safe; make one for each use.
class Stage {
 public:
  virtual ~Stage() = default;
  [[nodiscard]] virtual const StageInfo& info() const = 0;
  /// References into this object's parameters.
  [[nodiscard]] virtual std::vector<FieldRef> fields() = 0;
  /// One input a port, std::monostate for optional ones left out; returns one value an output port.
  /// Throws Error when an input is missing or of the wrong kind, and whatever the method throws.
  [[nodiscard]] std::vector<Data> run(std::span<const Data> inputs, const Context& context) const;

 protected:
  [[nodiscard]] virtual std::vector<Data> do_run(std::span<const Data> inputs, const Context& context) const = 0;
};

template <class S>
class StageOf final : public Stage {
 public:
  [[nodiscard]] const StageInfo& info() const override {
    static const StageInfo value = S::info();
    return value;
  }
  [[nodiscard]] std::vector<FieldRef> fields() override { return fields_of<S>(params_); }

 protected:
  [[nodiscard]] std::vector<Data> do_run(std::span<const Data> inputs, const Context& context) const override {
    return S::run(params_, inputs, context);
  }

 private:
  typename S::Params params_;
};

/// The stages a program knows, in the order in which they are listed.
class Registry {
 public:
  template <class S>
  void add() {
    makers_.push_back([]() -> std::unique_ptr<Stage> { return std::make_unique<StageOf<S>>(); });
  }
  /// By its name, or by the one it had in version 0.1. Error(usage), with the nearest right name, when there is none.
  [[nodiscard]] std::unique_ptr<Stage> make(std::string_view name) const;
  [[nodiscard]] bool has(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::vector<std::unique_ptr<Stage> (*)()> makers_;
};

/// Text for people: "image or labels".
[[nodiscard]] std::string kinds_text(std::span<const DataKind> kinds);

}  // namespace osteo
