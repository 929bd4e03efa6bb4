// The conformance statement's part on the network, from the tables by which associations are negotiated.
#include <algorithm>
#include <map>
#include <span>

#include "deidentify_table.h"
#include "node_tables.h"
#include "osteo/hospital/pacs/peer.h"
#include "osteo/hospital/pacs/receive.h"

namespace osteo::inline hospital {
namespace {

using namespace pacs;

std::string table(std::string_view head, std::span<const UidRow> rows) {
  std::string page = "| " + std::string(head) + " | UID |\n|---|---|\n";
  for (const UidRow& row : rows) page += "| " + std::string(row.name) + " | " + std::string(row.uid) + " |\n";
  return page + "\n";
}

std::string roles() {
  std::string page =
      "## Services and roles\n\n| service | class | role | command | transfer syntaxes |\n|---|---|---|---|---|\n";
  const auto row = [&](const UidRow& what, std::string_view role, std::string_view command, std::string_view forms) {
    page += "| " + std::string(what.name) + " | " + std::string(what.uid) + " | " + std::string(role) + " | " +
            std::string(command) + " | " + std::string(forms) + " |\n";
  };
  row(kVerification, "SCP", "`osteo receive`", "Explicit and Implicit VR Little Endian");
  row({"the storage classes below", "Storage (C-STORE)"}, "SCP", "`osteo receive`", "those of the storage node below");
  row({"the class of each object", "Storage (C-STORE)"}, "SCU", "`osteo send`", "that of each object, one a context");
  row(kFindStudyRoot, "SCU", "`osteo fetch`, `osteo send`", "Explicit and Implicit VR Little Endian");
  row(kGetStudyRoot, "SCU", "`osteo fetch`", "Explicit and Implicit VR Little Endian");
  row({"the classes that are fetched, below", "Storage within C-GET"}, "SCP (role selection)", "`osteo fetch`",
      "those that are fetched, below");
  return page +
         "\nNot supported: C-MOVE, C-FIND as a server, storage commitment, worklist, MPPS, print. DICOMweb: STOW-RS, "
         "QIDO-RS and WADO-RS as a client ([To and from a PACS](../how-to/pacs.md)).\n\n";
}

std::string node() {
  const ReceiveOptions by_default;
  return "## The storage node\n\n"
         "Title " +
         by_default.ae + ", address " + by_default.address + ", port " + std::to_string(by_default.port) +
         " by default; at most " + std::to_string(by_default.most_associations) +
         " associations at once. Who calls by a title that is not allowed is rejected. The asynchronous operations "
         "window, extended and user identity negotiation are not supported. Of the forms that a context offers, the "
         "first of this list is accepted:\n\n" +
         table("transfer syntax, in order of preference", kNodeSyntaxes) +
         "Each of the storage classes in each of them:\n\n" + table("storage class", kStorageClasses);
}

std::string deidentification() {
  std::map<DeidAction, std::size_t> count;
  for (const DeidRow& row : kDeidTable) ++count[row.action];
  constexpr std::pair<DeidAction, std::string_view> kNames[] = {
      {DeidAction::D, "D"},    {DeidAction::Z, "Z"},       {DeidAction::X, "X"},
      {DeidAction::U, "U"},    {DeidAction::ZD, "Z/D"},    {DeidAction::XZ, "X/Z"},
      {DeidAction::XD, "X/D"}, {DeidAction::XZD, "X/Z/D"}, {DeidAction::XZU, "X/Z/U*"}};
  std::string page =
      "## De-identification\n\n`osteo deidentify`: the Basic Application Level Confidentiality Profile (113100) of "
      "PS3.15 2026c, no option. Rows of table E.1-1 by their action, " +
      std::to_string(kDeidTable.size()) + " in all:\n\n| action | attributes |\n|---|---|\n";
  for (const auto& [action, name] : kNames)
    page += "| " + std::string(name) + " | " + std::to_string(count[action]) + " |\n";
  return page + "\nObjects of these classes; all others are left out:\n\n" + table("class", kDeidentified);
}

}  // namespace

std::string network_conformance() {
  return roles() + node() + "## What is fetched by C-GET\n\nEach of these images in each of these forms:\n\n" +
         table("class", kFetchedImages) + table("transfer syntax", kFetchedForms) +
         "Each of these objects in the first " + std::to_string(kPlainForms) + " of those forms:\n\n" +
         table("class", kFetchedObjects) +
         "## Security\n\nTLS by the profile BCP 195, not downgrading (PS3.15 B.12): TLS 1.2 or later, both sides with "
         "a "
         "certificate of an issuer that is named; none without `--tls-ca`. Audit messages by PS3.15 A.5 to a file or "
         "to "
         "syslog (TCP, TLS).\n\n" +
         deidentification();
}

}  // namespace osteo::inline hospital
