"""Rows of the table of peers: every study prints them as lines of JSON after ROW, run_peers.py lays them out."""
import json


def row(peer, what, against, result, holds, limit=""):
    """holds: True, False, or None where nothing is claimed (a ratio of times, a loss that is documented)."""
    print("ROW" + json.dumps({"peer": peer, "what": what, "against": against, "result": result, "limit": limit,
                              "verdict": {True: "agrees", False: "FAIL", None: ""}[holds if holds is None else bool(holds)]}), flush=True)


def missing(peer, reason):
    print("ROW" + json.dumps({"peer": peer, "what": "", "against": "", "result": reason, "limit": "", "verdict": "missing"}), flush=True)
