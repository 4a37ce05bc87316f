//! The ROUTE series: requests for routes, routes and road networks.

use super::cmasi::{KeyValuePair, Location3D, Waypoint};
use super::impact::LineOfInterest;
use super::registry::table;
use super::schema::{Series, SeriesName, TypeInfo};
use super::{LargeArray, Ref};

/// The series as the wire and the XML form know it.
pub const SERIES: Series =
    Series { name: SeriesName::new("ROUTE"), text: "ROUTE", namespace: "uxas.messages.route", version: 4 };

/// Its types by their number.
pub(super) const TYPES_BY_ID: [&TypeInfo; 14] = table(&[TYPES]);

lmcp_types! {
    SERIES "uxas.messages.route";

    /// A node of a road network.
    1 GraphNode {
        node_id "NodeID": i64,
        coordinates "Coordinates": Ref<Location3D>,
        associated_edges "AssociatedEdges": Vec<i64>,
    }

    /// A way between two nodes.
    2 GraphEdge {
        edge_id "EdgeID": i64,
        start_node "StartNode": i64,
        end_node "EndNode": i64,
        waypoints "Waypoints": Vec<Ref<Location3D>>,
    }

    /// A network of nodes and edges.
    3 GraphRegion {
        id "ID": i64,
        node_list "NodeList": LargeArray<Ref<GraphNode>>,
        edge_list "EdgeList": LargeArray<Ref<GraphEdge>>,
    }

    /// Two ends that a route is asked between.
    4 RouteConstraints {
        route_id "RouteID": i64,
        start_location "StartLocation": Ref<Location3D>,
        start_heading "StartHeading" ["deg"]: f32,
        use_start_heading "UseStartHeading": bool = true,
        end_location "EndLocation": Ref<Location3D>,
        end_heading "EndHeading" ["deg"]: f32,
        use_end_heading "UseEndHeading": bool = true,
    }

    /// Asks for routes of several vehicles.
    5 RouteRequest {
        request_id "RequestID": i64,
        associated_task_id "AssociatedTaskID": i64,
        vehicle_id "VehicleID": Vec<i64>,
        operating_region "OperatingRegion": i64,
        route_requests "RouteRequests": Vec<Ref<RouteConstraints>>,
        is_cost_only_request "IsCostOnlyRequest": bool = true,
    }

    /// Asks for routes of one vehicle.
    6 RoutePlanRequest {
        request_id "RequestID": i64,
        associated_task_id "AssociatedTaskID": i64,
        vehicle_id "VehicleID": i64,
        operating_region "OperatingRegion": i64,
        route_requests "RouteRequests": Vec<Ref<RouteConstraints>>,
        is_cost_only_request "IsCostOnlyRequest": bool = true,
    }

    /// A route, or why there is none.
    7 RoutePlan {
        route_id "RouteID": i64,
        waypoints "Waypoints": Vec<Ref<Waypoint>>,
        route_cost "RouteCost" ["ms"]: i64 = -1,
        route_error "RouteError": Vec<Ref<KeyValuePair>>,
    }

    /// Routes of one vehicle.
    8 RoutePlanResponse {
        response_id "ResponseID": i64,
        associated_task_id "AssociatedTaskID": i64,
        vehicle_id "VehicleID": i64,
        operating_region "OperatingRegion": i64,
        route_responses "RouteResponses": Vec<Ref<RoutePlan>>,
    }

    /// Routes of several vehicles.
    9 RouteResponse {
        response_id "ResponseID": i64,
        routes "Routes": Vec<Ref<RoutePlanResponse>>,
    }

    /// Asks for the ways out of a place.
    10 EgressRouteRequest {
        request_id "RequestID": i64,
        start_location "StartLocation": Ref<Location3D>,
        radius "Radius" ["m"]: f32 = 60.0,
    }

    /// The ways out of a place.
    11 EgressRouteResponse {
        response_id "ResponseID": i64,
        node_locations "NodeLocations": Vec<Ref<Location3D>>,
        headings "Headings" ["deg"]: Vec<f32>,
    }

    /// Two ends that points on roads are asked between.
    12 RoadPointsConstraints {
        road_points_id "RoadPointsID": i64,
        start_location "StartLocation": Ref<Location3D>,
        end_location "EndLocation": Ref<Location3D>,
    }

    /// Asks for points on roads.
    13 RoadPointsRequest {
        request_id "RequestID": i64,
        road_points_requests "RoadPointsRequests": Vec<Ref<RoadPointsConstraints>>,
    }

    /// Points on roads.
    14 RoadPointsResponse {
        response_id "ResponseID": i64,
        road_points_responses "RoadPointsResponses": Vec<Ref<LineOfInterest>>,
    }
}
